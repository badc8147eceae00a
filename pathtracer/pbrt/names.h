/* Names: a map from them to small numbers, and rows of tables. Not thread-safe. */
#ifndef PT_PBRT_NAMES_H
#define PT_PBRT_NAMES_H

#include <stddef.h>
#include <stdint.h>

/* Zero-initialise; owns copies of the names until release. */
struct pt_names {
    void *tree; /* owns; of search.h */
};

/* The number of `name`, -1 when there is none. */
int32_t pt_names_get(const struct pt_names *names, const char *name);
/* Sets or replaces; value >= 0, or -1: as if there were none. BASE_ENOMEM on failure, *names then as before; replacing never
 * fails. */
int pt_names_set(struct pt_names *names, const char *name, int32_t value);
void pt_names_release(struct pt_names *names);

/* The row of an array that begins with `name`, a const char *, or NULL. */
#define pt_row(rows, name) pt_row_named(rows, sizeof(rows) / sizeof *(rows), sizeof *(rows), name)
const void *pt_row_named(const void *rows, size_t count, size_t size, const char *name);

#endif
