/* How the time of reading grows with what is read: the kinds of input, for a test that all of it is read,
 * for `make bench` and for the plot in docs/. */
#ifndef TESTS_SUPPORT_BASE_READING_H
#define TESTS_SUPPORT_BASE_READING_H

#include <stddef.h>

struct base_reading {
    const char *name;
    size_t items; /* of the smallest input: some tenths of a millisecond */
    size_t most;  /* that the form allows; 0: any number */
    /* An input of so many items; the caller frees. NULL: it could not be made. */
    char *(*make)(size_t items, size_t *size);
    /* Reads what make made of so many items, in a copy that it takes. Thread seconds of the reader alone; negative: refused. */
    double (*read_s)(char *copy, size_t size, size_t items);
};

/* 0 where each kind's smallest input and one of eight times the items are read; says what was refused. */
int base_reading_check(const struct base_reading *readings, size_t count);

/* One line `name;items;bytes;seconds` to stdout for each size, doubled while the next takes less than `limit_s`. 1: refused. */
int base_reading_table(const struct base_reading *readings, size_t count, double limit_s);

#endif
