/* SPDX-License-Identifier: MIT
 *
 * The host that lull-check plays: real threads, worker numbers that are never shared, misbehaviour on request.
 */
#include "check.h"

#include <pthread.h>
#include <sched.h>
#include <string.h>

void lc_at_once(void *(*fn)(void *arg), void *args, size_t size, uint32_t count)
{
    pthread_t ids[LC_WORKERS_MAX];
    unsigned char started[LC_WORKERS_MAX] = {0};
    for (uint32_t t = 1; t < count; t++)
        started[t] = pthread_create(&ids[t], NULL, fn, (char *)args + t * size) == 0;
    for (uint32_t t = 0; t < count; t++)
        if (started[t])
            pthread_join(ids[t], NULL);
        else
            fn((char *)args + t * size);
}

/* A number that nobody else has; whoever finds none waits. */
static uint32_t worker_take(struct lc_host *h)
{
    for (uint32_t i = 0;; i++) {
        if (i == h->host.max_workers) {
            sched_yield();
            i = 0;
        }
        if (!atomic_exchange(&h->taken[i], 1))
            return i;
    }
}

/* One parallel_for: each thread takes every `step`-th task. */
struct job {
    struct lc_host *host;
    lull_task_fn fn;
    void *arg;
    uint64_t count, first, step;
};

static void *job_run(void *arg)
{
    const struct job *job = arg;
    uint32_t worker = worker_take(job->host);
    for (uint64_t i = job->first; i < job->count; i += job->step)
        job->fn(job->arg, job->host->reverse ? job->count - 1 - i : i, worker);
    atomic_store(&job->host->taken[worker], 0);
    return NULL;
}

static int32_t parallel_for(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    struct lc_host *h = host->context;
    if (!fn) {
        lc_fail(h->check, "parallel_for was called without a function");
        return LULL_E_INVALID;
    }
    uint64_t wanted = h->cancel && count > 1 ? 1 : count;
    uint32_t threads = wanted < h->threads ? (uint32_t)wanted : h->threads;
    struct job jobs[LC_WORKERS_MAX];
    for (uint32_t t = 0; t < threads; t++)
        jobs[t] = (struct job){h, fn, arg, wanted, t, threads};
    lc_at_once(job_run, jobs, sizeof *jobs, threads);
    return wanted < count ? LULL_E_CANCELLED : LULL_OK;
}

static void log_line(const struct lull_host *host, int32_t level, const char *text)
{
    struct lc_host *h = host->context;
    if (!text || level < LULL_LOG_ERROR || level > LULL_LOG_DEBUG || strchr(text, '\n'))
        lc_fail(h->check, "log: not one line of a known level");
}

static int32_t cancelled(const struct lull_host *host) { return ((const struct lc_host *)host->context)->cancel; }

static const void *get_extension(const struct lull_host *host, const char *id)
{
    struct lc_host *h = host->context;
    if (!id)
        lc_fail(h->check, "the host's get_extension was called without an id");
    return NULL;
}

void lc_host_init(struct lc_host *h, struct lc *c, uint32_t threads)
{
    uint32_t workers = 2 * threads < LC_WORKERS_MAX ? 2 * threads : LC_WORKERS_MAX;
    *h = (struct lc_host){.threads = (workers + 1) / 2, .check = c};
    h->host = (struct lull_host){.struct_size = sizeof h->host,
                                 .api_minor = LULL_API_MINOR,
                                 .context = h,
                                 .name = "lull-check",
                                 .max_workers = workers,
                                 .log = log_line,
                                 .parallel_for = parallel_for,
                                 .cancelled = cancelled,
                                 .get_extension = get_extension};
}
