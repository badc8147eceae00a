/* Whether what a list names is named once, in n log n. Thread-safe. */
#ifndef BASE_UNIQUE_H
#define BASE_UNIQUE_H

#include <stddef.h>
#include <stdint.h>

/* Numbers at at, at + stride, …: 0 if all `count` of them differ, 1 and one that does not to *twice, BASE_ENOMEM. */
int base_unique_numbers(const uint32_t *at, size_t stride, size_t count, uint32_t *twice);
/* The same for texts; *twice points to one of them. */
int base_unique_texts(const char *at, size_t stride, size_t count, const char **twice);

#endif
