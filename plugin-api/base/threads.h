/*
 * A fixed pool of worker threads that runs index ranges.
 *
 * Results must not depend on which worker runs which index or in what order: `worker` selects scratch memory and nothing
 * else. One parallel_for at a time per pool; a body must not call parallel_for of the same pool.
 */
#ifndef BASE_THREADS_H
#define BASE_THREADS_H

#include <stdint.h>

#include "base/err.h"

struct base_threads;

/* Number of processors this process may use, at least 1: those it is bound to, and as many as its control groups (of a
 * container, of a batch system) give it time for. */
int base_threads_available(void);
/* The latter alone, of the system whose files lie below `root` ("" for this one); INT_MAX: no limit. */
int base_threads_quota(const char *root);

/* count >= 1 workers including the caller; owns count-1 threads until destroy. NULL on failure (err says why). */
struct base_threads *base_threads_create(int count, struct base_err *err);
void base_threads_destroy(struct base_threads *threads);
int base_threads_count(const struct base_threads *threads);

/* Calls fn(data, i, worker) once for each i in [0, n), worker in [0, count); returns when all are done. threads NULL: all of
 * it here, as worker 0. Calls that follow within microseconds cost a fraction of one: workers look for the next before they
 * sleep, unless they outnumber the processors. */
void base_threads_for(struct base_threads *threads, long n, void (*fn)(void *data, long i, int worker), void *data);

/* The same for any number of tasks, in the form that criteria know. */
void base_threads_tasks(struct base_threads *threads, uint64_t count, void (*fn)(void *arg, uint64_t task, uint32_t worker),
                        void *arg);

/* A program's main(): runs it, and where its stack may not grow as large as usual (ulimit -s) on a thread with such a one;
 * what libraries start has one, too. The exit status; 1, and one line, where there is no memory for that. After a failure
 * the process ends here: libraries that lack memory may die even of cleaning up. */
int base_threads_main(int argc, char **argv, int (*run)(int argc, char **argv));

#endif
