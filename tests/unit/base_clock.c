/* Processor time: that of child processes counts when they have ended, as a check has the denoiser's. */
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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(children_count)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
