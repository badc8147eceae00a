/* Processor time: that of child processes counts while they live and when they have ended, as a check has the denoiser's. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/clock.h"

static void work(double thread_s)
{
    const double end_s = base_clock_thread_s() + thread_s;
    while (base_clock_thread_s() < end_s)
        ;
}

/* getrusage counts in ticks of the scheduler on some systems: 10 ms */
static const double TICK_S = 0.01, WORK_S = 0.2;

static void children_count(void **state)
{
    (void)state;
    const double start_s = base_clock_process_s();
    work(WORK_S);
    const double alone_s = base_clock_process_s() - start_s;
    assert_true(alone_s >= WORK_S - TICK_S);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        work(WORK_S);
        _exit(0);
    }
    assert_int_equal(waitpid(child, NULL, 0), child);
    assert_true(base_clock_process_s() - start_s - alone_s >= WORK_S - TICK_S);
}

/* The denoiser's process waits from check to check. */
static void living_children_count(void **state)
{
    (void)state;
    char byte;
    int worked[2], wanted[2];
    assert_int_equal(pipe(worked) | pipe(wanted), 0);
    const double start_s = base_clock_process_s();
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        close(wanted[1]);
        work(WORK_S);
        if (write(worked[1], "", 1) == 1 && read(wanted[0], &byte, 1) == 0)
            _exit(0);
        _exit(1);
    }
    assert_int_equal(read(worked[0], &byte, 1), 1);
    const double living_s = base_clock_process_s() - start_s;
    assert_true(living_s >= WORK_S);
    close(wanted[1]);
    assert_int_equal(waitpid(child, NULL, 0), child);
    const double ended_s = base_clock_process_s() - start_s;
    assert_true(ended_s >= WORK_S - TICK_S && ended_s < 1.5 * living_s);
    close(wanted[0]);
    close(worked[0]);
    close(worked[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(children_count), cmocka_unit_test(living_children_count)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
