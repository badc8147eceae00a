/* Which signals interrupt a program. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <signal.h>

#include <cmocka.h>

#include "base/interrupt.h"

static void signals_interrupt(void **state)
{
    (void)state;
    assert_false(base_interrupted);
    base_interrupt_catch();
    raise(SIGTERM);
    assert_true(base_interrupted);
    base_interrupted = 0;
    base_interrupt_catch();
    raise(SIGHUP);
    assert_true(base_interrupted);
    signal(SIGHUP, SIG_IGN); /* nohup */
    base_interrupted = 0;
    base_interrupt_catch();
    assert_true(raise(SIGHUP) == 0 && raise(SIGPIPE) == 0 && !base_interrupted);
    signal(SIGHUP, SIG_DFL);
    raise(SIGINT);
    assert_true(base_interrupted);
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(signals_interrupt)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
