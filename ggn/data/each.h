/* Work in parallel that can fail: each part has an error of its own. */
#ifndef GGN_DATA_EACH_H
#define GGN_DATA_EACH_H

#include "base/threads.h"

/* Calls fn as base_threads_for does, for all i in [0, n), also when one fails. Returns the first error in order of i. what:
 * is named where there is no memory for the errors. */
int ggn_each(struct base_threads *threads, long n, int (*fn)(void *data, long i, int worker, struct base_err *err),
             void *data, const char *what, struct base_err *err);

#endif
