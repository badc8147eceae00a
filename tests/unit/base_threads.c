/* The pool: each index once, whoever takes it; nobody waits for a worker that never came. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/threads.h"

enum { THREADS = 4, INDICES = 64, JOBS = 3000 };

struct job {
    atomic_int taken[INDICES], inside[THREADS];
    atomic_int twice; /* two threads as one worker at the same time */
    atomic_int who;   /* bit per worker that took an index */
    int everybody;    /* bits of all workers: each task waits until all of them have come; 0: none waits */
};

static void take(void *data, long i, int worker)
{
    struct job *j = data;
    if (atomic_fetch_add(&j->inside[worker], 1) != 0)
        atomic_store(&j->twice, 1);
    atomic_fetch_or(&j->who, 1 << worker);
    while ((atomic_load(&j->who) & j->everybody) != j->everybody)
        nanosleep(&(struct timespec){.tv_nsec = 100000}, NULL);
    atomic_fetch_add(&j->taken[i], 1);
    atomic_fetch_sub(&j->inside[worker], 1);
}

static void expect_once(struct base_threads *t, struct job *j, long n)
{
    for (int i = 0; i < INDICES; i++)
        atomic_store(&j->taken[i], 0);
    base_threads_for(t, n, take, j);
    for (int i = 0; i < INDICES; i++)
        assert_int_equal(atomic_load(&j->taken[i]), i < n);
    assert_int_equal(atomic_load(&j->twice), 0);
}

/* One after the other, so that workers come late, and with pauses, so that they sleep. */
static void each_index_once(void **state)
{
    struct base_err err = {0};
    struct job j = {.everybody = 0};
    (void)state;
    for (int threads = 1; threads <= THREADS; threads++) {
        struct base_threads *t = base_threads_create(threads, &err);
        assert_non_null(t);
        for (int k = 0; k < JOBS; k++) {
            if (k % 500 == 499)
                nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
            expect_once(t, &j, k % (INDICES + 1));
        }
        base_threads_destroy(t);
    }
}

/* Tasks that wait for each other are shared out, also to workers that slept. */
static void all_workers_take_part(void **state)
{
    struct base_err err = {0};
    struct base_threads *t = base_threads_create(THREADS, &err);
    struct job j = {.everybody = (1 << THREADS) - 1};
    (void)state;
    assert_non_null(t);
    for (int k = 0; k < 3; k++) {
        atomic_store(&j.who, 0);
        nanosleep(&(struct timespec){.tv_nsec = 5000000}, NULL);
        expect_once(t, &j, INDICES);
        assert_int_equal(atomic_load(&j.who), j.everybody);
    }
    base_threads_destroy(t);
}

/* A pool that never had a job, or has one after a long rest, ends too. */
static void destroys_idle(void **state)
{
    struct base_err err = {0};
    (void)state;
    for (int k = 0; k < 50; k++) {
        struct base_threads *t = base_threads_create(THREADS, &err);
        assert_non_null(t);
        if (k % 2)
            nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
        base_threads_destroy(t);
    }
}

/* A child of fork has none of the workers: it does the work alone, and waits for nobody. */
static void works_in_a_child_of_fork(void **state)
{
    struct base_err err = {0};
    struct base_threads *t = base_threads_create(THREADS, &err);
    struct job j = {.everybody = 0};
    int status = -1;
    (void)state;
    assert_non_null(t);
    expect_once(t, &j, INDICES);
    const pid_t child = fork();
    if (child == 0) {
        alarm(20);
        for (int i = 0; i < INDICES; i++)
            atomic_store(&j.taken[i], 0);
        base_threads_for(t, INDICES, take, &j);
        int once = 1;
        for (int i = 0; i < INDICES; i++)
            once &= atomic_load(&j.taken[i]) == 1;
        base_threads_destroy(t);
        _exit(!once);
    }
    assert_true(child > 0 && waitpid(child, &status, 0) == child);
    assert_int_equal(status, 0);
    expect_once(t, &j, INDICES);
    base_threads_destroy(t);
}

/* Control groups give time for so many processors, rounded up: the least of a group and those that it is in, of either
 * version, also where a container does not show where its group is. */
static void control_groups_limit(void **state)
{
    static const struct {
        const char *make;
        int expected;
    } cases[] = {
        {"echo 0::/a/b >proc/self/cgroup; mkdir -p $g/a/b; echo 250000 100000 >$g/a/b/cpu.max", 3},
        {"echo 0::/a/b >proc/self/cgroup; mkdir -p $g/a/b; echo max 100000 >$g/a/b/cpu.max; echo 50000 100000 >$g/a/cpu.max",
         1},
        {"echo 0::/ >proc/self/cgroup; echo 400000 100000 >$g/cpu.max", 4},
        {"echo 0::/ >proc/self/cgroup; echo max 100000 >$g/cpu.max", INT_MAX},
        {"printf '5:cpuset:/\\n4:cpu,cpuacct:/docker/1\\n0::/\\n' >proc/self/cgroup; mkdir -p $g/cpu,cpuacct $g/cpuset; "
         "echo 150000 >$g/cpu,cpuacct/cpu.cfs_quota_us; echo 100000 >$g/cpu,cpuacct/cpu.cfs_period_us",
         2},
        {"echo 1:cpu:/ >proc/self/cgroup; mkdir -p $g/cpu; echo -1 >$g/cpu/cpu.cfs_quota_us; echo 100000 "
         ">$g/cpu/cpu.cfs_period_us",
         INT_MAX},
        {"rm -r proc", INT_MAX},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char root[] = "/tmp/lull-cgroup-XXXXXX", command[600];
        assert_non_null(mkdtemp(root));
        snprintf(command, sizeof command, "cd %s && g=sys/fs/cgroup && mkdir -p proc/self $g && { %s; }", root,
                 cases[i].make);
        assert_int_equal(system(command), 0);
        assert_int_equal(base_threads_quota(root), cases[i].expected);
        snprintf(command, sizeof command, "rm -rf %s", root);
        assert_int_equal(system(command), 0);
    }
    assert_true(base_threads_available() >= 1 && base_threads_available() <= base_threads_quota(""));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_index_once),          cmocka_unit_test(all_workers_take_part), cmocka_unit_test(destroys_idle),
        cmocka_unit_test(works_in_a_child_of_fork), cmocka_unit_test(control_groups_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
