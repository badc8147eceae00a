/* Lists of numbers on a command line: 0,3,8-11. */
#ifndef BASE_LIST_H
#define BASE_LIST_H

/* The next A, A-B or, where step is not NULL, A-B:STEP of a list: what follows, "" after the last; NULL where there is none
 * or it is not well formed. *step is 1 where none is given. What is too large is ULONG_MAX. No pointer of the caller moves:
 * GCC 14.2 compiles that wrongly (-ftree-pre), and `0` would be no list of 0. */
const char *base_list_next(const char *at, unsigned long *first, unsigned long *last, unsigned long *step);

#endif
