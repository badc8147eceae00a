/* SPDX-License-Identifier: MIT
 *
 * The host that lull-check plays: real threads, worker numbers that are never shared, misbehaviour on request.
 */
#include "check.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { WORKERS_MAX = 64 };

struct lc_workers {
    pthread_mutex_t mutex;
    pthread_cond_t freed;
    uint32_t count;
    unsigned char taken[WORKERS_MAX];
};

static uint32_t worker_take(struct lc_workers *w)
{
    pthread_mutex_lock(&w->mutex);
    for (;;) {
        for (uint32_t i = 0; i < w->count; i++)
            if (!w->taken[i]) {
                w->taken[i] = 1;
                pthread_mutex_unlock(&w->mutex);
                return i;
            }
        pthread_cond_wait(&w->freed, &w->mutex);
    }
}

static void worker_give(struct lc_workers *w, uint32_t worker)
{
    pthread_mutex_lock(&w->mutex);
    w->taken[worker] = 0;
    pthread_cond_signal(&w->freed);
    pthread_mutex_unlock(&w->mutex);
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
    uint32_t worker = worker_take(job->host->workers);
    for (uint64_t i = job->first; i < job->count; i += job->step)
        job->fn(job->arg, job->host->reverse ? job->count - 1 - i : i, worker);
    worker_give(job->host->workers, worker);
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
    struct job jobs[WORKERS_MAX];
    pthread_t ids[WORKERS_MAX];
    unsigned char started[WORKERS_MAX] = {0};
    for (uint32_t t = 0; t < threads; t++) {
        jobs[t] = (struct job){h, fn, arg, wanted, t, threads};
        started[t] = t > 0 && pthread_create(&ids[t], NULL, job_run, &jobs[t]) == 0;
    }
    for (uint32_t t = 0; t < threads; t++)
        if (!started[t])
            job_run(&jobs[t]);
    for (uint32_t t = 0; t < threads; t++)
        if (started[t])
            pthread_join(ids[t], NULL);
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

int lc_host_init(struct lc_host *h, struct lc *c, uint32_t threads)
{
    uint32_t workers = 2 * threads < WORKERS_MAX ? 2 * threads : WORKERS_MAX;
    *h = (struct lc_host){.threads = (workers + 1) / 2, .check = c, .workers = calloc(1, sizeof *h->workers)};
    if (!LC_EXPECT(c, h->workers, "out of memory"))
        return -1;
    pthread_mutex_init(&h->workers->mutex, NULL);
    pthread_cond_init(&h->workers->freed, NULL);
    h->workers->count = workers;
    h->host = (struct lull_host){.struct_size = sizeof h->host,
                                 .api_minor = LULL_API_MINOR,
                                 .context = h,
                                 .name = "lull-check",
                                 .max_workers = workers,
                                 .log = log_line,
                                 .parallel_for = parallel_for,
                                 .cancelled = cancelled,
                                 .get_extension = get_extension};
    return 0;
}

void lc_host_release(struct lc_host *h)
{
    if (h->workers) {
        pthread_mutex_destroy(&h->workers->mutex);
        pthread_cond_destroy(&h->workers->freed);
    }
    free(h->workers);
    h->workers = NULL;
}
