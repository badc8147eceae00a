#define _GNU_SOURCE /* sched_getaffinity */
#include "base/threads.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

struct worker {
    struct base_threads *pool;
    pthread_t thread;
    int id;
};

struct base_threads {
    pthread_mutex_t lock;
    pthread_cond_t work, done;
    unsigned long generation; /* counts jobs; guarded by lock */
    int running;              /* workers that have not finished the job; guarded by lock */
    int quit;
    int count, started;
    long n;
    atomic_long next;
    void (*fn)(void *, long, int);
    void *data;
    struct worker workers[];
};

int base_threads_available(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0 && CPU_COUNT(&set) > 0)
        return CPU_COUNT(&set);
    return 1;
}

static void take_indices(struct base_threads *t, int worker)
{
    for (long i; (i = atomic_fetch_add(&t->next, 1)) < t->n;)
        t->fn(t->data, i, worker);
}

static void *worker_main(void *arg)
{
    struct worker *w = arg;
    struct base_threads *t = w->pool;
    unsigned long seen = 0;
    pthread_mutex_lock(&t->lock);
    for (;;) {
        while (!t->quit && t->generation == seen)
            pthread_cond_wait(&t->work, &t->lock);
        if (t->quit)
            break;
        seen = t->generation;
        pthread_mutex_unlock(&t->lock);
        take_indices(t, w->id);
        pthread_mutex_lock(&t->lock);
        if (--t->running == 0)
            pthread_cond_signal(&t->done);
    }
    pthread_mutex_unlock(&t->lock);
    return NULL;
}

struct base_threads *base_threads_create(int count, struct base_err *err)
{
    struct base_threads *t = calloc(1, sizeof *t + (size_t)count * sizeof t->workers[0]);
    if (!t) {
        base_fail_nomem(err, "thread pool");
        return NULL;
    }
    pthread_mutex_init(&t->lock, NULL);
    pthread_cond_init(&t->work, NULL);
    pthread_cond_init(&t->done, NULL);
    t->count = count;
    for (int i = 1; i < count; i++) {
        t->workers[i] = (struct worker){.pool = t, .id = i};
        if (pthread_create(&t->workers[i].thread, NULL, worker_main, &t->workers[i]) != 0) {
            base_fail(err, BASE_ENOMEM, "cannot start thread %d of %d", i + 1, count);
            base_threads_destroy(t);
            return NULL;
        }
        t->started++;
    }
    return t;
}

void base_threads_destroy(struct base_threads *t)
{
    if (!t)
        return;
    pthread_mutex_lock(&t->lock);
    t->quit = 1;
    pthread_cond_broadcast(&t->work);
    pthread_mutex_unlock(&t->lock);
    for (int i = 1; i <= t->started; i++)
        pthread_join(t->workers[i].thread, NULL);
    pthread_mutex_destroy(&t->lock);
    pthread_cond_destroy(&t->work);
    pthread_cond_destroy(&t->done);
    free(t);
}

int base_threads_count(const struct base_threads *t)
{
    return t->count;
}

void base_threads_for(struct base_threads *t, long n, void (*fn)(void *, long, int), void *data)
{
    if (n <= 0)
        return;
    pthread_mutex_lock(&t->lock);
    t->fn = fn;
    t->data = data;
    t->n = n;
    atomic_store(&t->next, 0);
    t->running = t->started;
    t->generation++;
    pthread_cond_broadcast(&t->work);
    pthread_mutex_unlock(&t->lock);
    take_indices(t, 0);
    pthread_mutex_lock(&t->lock);
    while (t->running > 0)
        pthread_cond_wait(&t->done, &t->lock);
    pthread_mutex_unlock(&t->lock);
}
