#define _GNU_SOURCE /* sched_getaffinity */
#include "base/threads.h"

#include <fcntl.h>
#include <limits.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/files.h"

struct worker {
    struct base_threads *pool;
    pthread_t thread;
    int id;
};

/* A job is posted as an odd `state` and closed as the even one after it. Workers look at it for a while before they sleep,
 * because the layers of a network follow each other within microseconds and waking a thread takes longer than most of them.
 * Who wakes too late finds the job closed and is not waited for.
 *
 * Pairs of atomics that two threads write and read crosswise, all sequentially consistent, so that one sees the other:
 * a worker enters (running) and then looks whether the job is still open (state), the caller closes it and then looks at
 * running; a worker is about to sleep (sleeping) and looks at state, the caller posts and looks at sleeping; the caller is
 * about to sleep (finishing) and looks at running, a worker leaves and looks at finishing. */
struct base_threads {
    pthread_mutex_t lock; /* for the two conditions only */
    pthread_cond_t work, done;
    atomic_ulong state;
    atomic_int running; /* workers that have entered a job, or are about to see that it is closed */
    atomic_int sleeping, finishing;
    atomic_int quit;
    int count, started, looks;
    pid_t owner; /* a child of fork has the pool, but none of its workers */
    long n;
    atomic_long next;
    void (*fn)(void *, long, int);
    void *data;
    struct worker workers[];
};

/* Of threads, and of a program's own: what its limit (ulimit -s) usually is. */
#define STACK_BYTES ((size_t)8 << 20)

/* How often one looks before one sleeps: some fifty microseconds, about what waking would take. */
enum { LOOKS = 2000 };

static double fewer(double a, double b) { return b > 0 && (a <= 0 || b < a) ? b : a; }

/* A small file's text, "" if there is none. By no stream: that would allocate, and fail without a word. */
static void read_text(const char *folder, const char *name, char *to, size_t room)
{
    char path[PATH_MAX];
    const int fd =
        snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    const ssize_t n = fd < 0 ? 0 : read(fd, to, room - 1);
    to[n > 0 ? n : 0] = '\0';
    if (fd >= 0)
        close(fd);
}

/* Reads one or two numbers of a file; returns how many there are. */
static int read_numbers(const char *folder, const char *name, long to[2])
{
    char text[64];
    read_text(folder, name, text, sizeof text);
    return sscanf(text, "%ld %ld", &to[0], &to[1]);
}

/* Processors' worth of time of one control group, of version 2 ("max": none) or 1 (-1: none); 0: no limit. */
static double quota_of(const char *folder)
{
    long v[2], period[2];
    if (read_numbers(folder, "cpu.max", v) != 2) {
        if (read_numbers(folder, "cpu.cfs_quota_us", v) < 1 || read_numbers(folder, "cpu.cfs_period_us", period) < 1)
            return 0;
        v[1] = period[0];
    }
    return v[0] > 0 && v[1] > 0 ? (double)v[0] / (double)v[1] : 0;
}

/* The least of a group's and of all that it is in. In a container the path may begin elsewhere: what is not there limits
 * nothing. */
static double quota_along(const char *root, const char *controller, char *group)
{
    double least = 0;
    for (char *end = group + strlen(group); end; end = strrchr(group, '/')) {
        char folder[PATH_MAX];
        *end = '\0';
        if (snprintf(folder, sizeof folder, "%s/sys/fs/cgroup/%s%s", root, controller, group) < (int)sizeof folder)
            least = fewer(least, quota_of(folder));
    }
    return least;
}

/* Lines are ID:CONTROLLERS:PATH (cgroups(7)); version 2 has no controllers there. */
int base_threads_quota(const char *root)
{
    char text[PATH_MAX], *next = text;
    double least = 0;
    read_text(root, "proc/self/cgroup", text, sizeof text);
    for (char *line; (line = strsep(&next, "\n"));) {
        char *controller = strchr(line, ':'), *group = controller ? strchr(controller + 1, ':') : NULL;
        if (!group)
            continue;
        *group++ = '\0';
        if (*++controller == '\0' || strcmp(controller, "cpu") == 0 || strcmp(controller, "cpu,cpuacct") == 0)
            least = fewer(least, quota_along(root, controller, group));
    }
    return least > 0 && least < INT_MAX ? (int)ceil(least) : INT_MAX;
}

int base_threads_available(void)
{
    cpu_set_t set;
    const long online = sysconf(_SC_NPROCESSORS_ONLN); /* of more than fit into the set */
    const int quota = base_threads_quota("");
    int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : (int)online;
    count = count < quota ? count : quota;
    return count > 0 ? count : 1;
}

static void take_indices(struct base_threads *t, int worker)
{
    for (long i; (i = atomic_fetch_add(&t->next, 1)) < t->n;)
        t->fn(t->data, i, worker);
}

static void relax(void)
{
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}

static void sleep_while(struct base_threads *t, unsigned long seen)
{
    pthread_mutex_lock(&t->lock);
    atomic_fetch_add(&t->sleeping, 1);
    while (!atomic_load(&t->quit) && atomic_load(&t->state) == seen)
        pthread_cond_wait(&t->work, &t->lock);
    atomic_fetch_sub(&t->sleeping, 1);
    pthread_mutex_unlock(&t->lock);
}

static void leave(struct base_threads *t)
{
    if (atomic_fetch_sub(&t->running, 1) != 1 || !atomic_load(&t->finishing))
        return;
    pthread_mutex_lock(&t->lock);
    pthread_cond_signal(&t->done);
    pthread_mutex_unlock(&t->lock);
}

static void *worker_main(void *arg)
{
    struct worker *w = arg;
    struct base_threads *t = w->pool;
    unsigned long seen = 0;
    int looks = t->looks;

    while (!atomic_load(&t->quit)) {
        const unsigned long state = atomic_load(&t->state);
        if (state == seen && looks-- > 0) {
            relax();
        } else if (state == seen) {
            sleep_while(t, seen);
            looks = t->looks;
        } else {
            seen = state;
            atomic_fetch_add(&t->running, 1);
            if (state % 2 && atomic_load(&t->state) == state) {
                take_indices(t, w->id);
                looks = t->looks;
            }
            leave(t);
        }
    }
    return NULL;
}

/* With the stack that threads have, but no smaller one than usual. */
static int start(pthread_t *thread, void *(*fn)(void *), void *arg)
{
    pthread_attr_t attributes;
    size_t size;
    int why = pthread_attr_init(&attributes);
    if (why)
        return why;
    if (pthread_attr_getstacksize(&attributes, &size) == 0 && size < STACK_BYTES)
        pthread_attr_setstacksize(&attributes, STACK_BYTES);
    why = pthread_create(thread, &attributes, fn, arg);
    pthread_attr_destroy(&attributes);
    return why;
}

struct program {
    int argc, status;
    char **argv;
    int (*run)(int argc, char **argv);
};

static void *run_program(void *data)
{
    struct program *p = data;
    p->status = p->run(p->argc, p->argv);
    return NULL;
}

/* Libraries that lack memory may die even of cleaning up behind a failure. */
static int leave_with(int status)
{
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) /* which look for leaks then */
    if (status != 0) {
        fflush(NULL);
        _exit(status);
    }
#endif
    return status;
}

int base_threads_main(int argc, char **argv, int (*run)(int argc, char **argv))
{
    struct program p = {.argc = argc, .argv = argv, .run = run};
    struct rlimit limit;
    pthread_attr_t attributes;
    pthread_t thread;
    if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= STACK_BYTES)
        return leave_with(run(argc, argv));
    if (pthread_attr_init(&attributes) == 0) { /* those that libraries start */
        pthread_attr_setstacksize(&attributes, STACK_BYTES);
        pthread_setattr_default_np(&attributes);
        pthread_attr_destroy(&attributes);
    }
    if (start(&thread, run_program, &p) != 0) {
        fprintf(stderr, "%s: out of memory (a stack of 8 MB; ulimit -s allows %llu KB)\n",
                argc > 0 ? base_file_name(argv[0]) : "lull", (unsigned long long)limit.rlim_cur >> 10);
        return 1;
    }
    pthread_join(thread, NULL);
    return leave_with(p.status);
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
    t->owner = getpid();
    t->looks = count <= base_threads_available() ? LOOKS : 0; /* who looks keeps no processor from who works */
    for (int i = 1; i < count; i++) {
        t->workers[i] = (struct worker){.pool = t, .id = i};
        if (start(&t->workers[i].thread, worker_main, &t->workers[i]) != 0) {
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
    if (t && t->owner == getpid()) {
        pthread_mutex_lock(&t->lock);
        atomic_store(&t->quit, 1);
        pthread_cond_broadcast(&t->work);
        pthread_mutex_unlock(&t->lock);
        for (int i = 1; i <= t->started; i++)
            pthread_join(t->workers[i].thread, NULL);
        pthread_mutex_destroy(&t->lock);
        pthread_cond_destroy(&t->work);
        pthread_cond_destroy(&t->done);
    }
    free(t);
}

int base_threads_count(const struct base_threads *t) { return t->count; }

static void post(struct base_threads *t)
{
    atomic_fetch_add(&t->state, 1);
    if (!atomic_load(&t->sleeping))
        return;
    pthread_mutex_lock(&t->lock);
    pthread_cond_broadcast(&t->work);
    pthread_mutex_unlock(&t->lock);
}

static void finish(struct base_threads *t)
{
    atomic_fetch_add(&t->state, 1);
    for (int k = t->looks; k > 0 && atomic_load(&t->running) > 0; k--)
        relax();
    if (!atomic_load(&t->running))
        return;
    pthread_mutex_lock(&t->lock);
    atomic_store(&t->finishing, 1);
    while (atomic_load(&t->running) > 0)
        pthread_cond_wait(&t->done, &t->lock);
    atomic_store(&t->finishing, 0);
    pthread_mutex_unlock(&t->lock);
}

void base_threads_for(struct base_threads *t, long n, void (*fn)(void *, long, int), void *data)
{
    if (n <= 1 || !t || t->started == 0 || t->owner != getpid()) {
        for (long i = 0; i < n; i++)
            fn(data, i, 0);
        return;
    }
    t->fn = fn;
    t->data = data;
    t->n = n;
    atomic_store(&t->next, 0);
    post(t);
    take_indices(t, 0);
    finish(t);
}

struct tasks {
    void (*fn)(void *arg, uint64_t task, uint32_t worker);
    void *arg;
    uint64_t first;
};

static void run_task(void *data, long i, int worker)
{
    const struct tasks *t = data;
    t->fn(t->arg, t->first + (uint64_t)i, (uint32_t)worker);
}

void base_threads_tasks(struct base_threads *threads, uint64_t count, void (*fn)(void *arg, uint64_t task, uint32_t worker),
                        void *arg)
{
    struct tasks t = {.fn = fn, .arg = arg};
    for (uint64_t n; t.first < count; t.first += n) {
        n = count - t.first < LONG_MAX / 2 ? count - t.first : LONG_MAX / 2;
        base_threads_for(threads, (long)n, run_task, &t);
    }
}
