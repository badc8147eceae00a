/* Lists: of numbers on a command line, 0,3,8-11; and whether what one names is named once. Thread-safe. */
#ifndef BASE_LIST_H
#define BASE_LIST_H

#include <stddef.h>
#include <stdint.h>

/* The next A, A-B or, where step is not NULL, A-B:STEP of a list: what follows, "" after the last; NULL where there is none
 * or it is not well formed. *step is 1 where none is given. What is too large is ULONG_MAX. No pointer of the caller moves:
 * GCC 14.2 compiles that wrongly (-ftree-pre), and `0` would be no list of 0. */
const char *base_list_next(const char *at, unsigned long *first, unsigned long *last, unsigned long *step);

/* Numbers at at, at + stride, …: 0 if all `count` of them differ, 1 and one that does not to *twice, BASE_ENOMEM. */
int base_unique_numbers(const uint32_t *at, size_t stride, size_t count, uint32_t *twice);
/* The same for texts; *twice points to one of them. */
int base_unique_texts(const char *at, size_t stride, size_t count, const char **twice);

#endif
