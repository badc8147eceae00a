/*
 * A fixed pool of worker threads that runs index ranges.
 *
 * Results must not depend on which worker runs which index or in what order: `worker` selects scratch memory and nothing
 * else. One parallel_for at a time per pool; a body must not call parallel_for of the same pool.
 */
#ifndef PT_BASE_THREADS_H
#define PT_BASE_THREADS_H

#include "base/err.h"

struct pt_threads;

/* Number of processors this process may use, at least 1. */
int pt_threads_available(void);

/* count >= 1 workers including the caller; owns count-1 threads until destroy. NULL on failure (err says why). */
struct pt_threads *pt_threads_create(int count, struct pt_err *err);
void pt_threads_destroy(struct pt_threads *threads);
int pt_threads_count(const struct pt_threads *threads);

/* Calls fn(data, i, worker) once for each i in [0, n), worker in [0, count); returns when all are done. */
void pt_threads_for(struct pt_threads *threads, long n, void (*fn)(void *data, long i, int worker), void *data);

#endif
