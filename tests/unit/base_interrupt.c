/* Which signals interrupt a program. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

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
    for (int i = 0; i < 3; i++) { /* the soft limit of processor time, each second anew */
        base_interrupted = 0;
        raise(SIGXCPU);
        assert_true(base_interrupted);
    }
    signal(SIGXCPU, SIG_DFL);
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
}

/* What is closed stays of no use to anybody, and its number is no file's: 0 if so, else what is wrong. */
static int without_standard_files(void)
{
    for (int fd = 0; fd < 3; fd++)
        close(fd);
    base_interrupt_begin();
    char byte = 0;
    const int reads = read(0, &byte, 1) != -1 || errno != EBADF;
    const int writes = write(1, "", 1) != -1 || errno != EBADF || write(2, "", 1) != -1 || errno != EBADF;
    return reads + 2 * writes + 4 * (open("/dev/null", O_RDONLY) < 3);
}

static void closed_standard_files_are_nobodys(void **state)
{
    (void)state;
    int status = 0;
    const pid_t child = fork();
    if (child == 0)
        _exit(without_standard_files());
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(signals_interrupt),
                                       cmocka_unit_test(closed_standard_files_are_nobodys)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
