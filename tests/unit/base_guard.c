/* What becomes of a process that dies, or waits, in a library that lacks memory. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/guard.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

static const int by_signal[] = {SIGSEGV, SIGBUS, SIGILL, SIGTRAP, SIGABRT};

/* The status of a child that does this, and what it says; 128 + the signal it died of. */
static int child_of(void (*dies)(int how), int how, char *said, size_t room)
{
    int ends[2], status;
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0) {
        const struct rlimit no_core = {0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        for (size_t i = 0; i < sizeof by_signal / sizeof by_signal[0]; i++)
            signal(by_signal[i], SIG_DFL); /* and not what cmocka does */
        dup2(ends[1], STDERR_FILENO);
        dies(how);
        _exit(77);
    }
    close(ends[1]);
    const ssize_t n = read(ends[0], said, room - 1);
    said[n > 0 ? n : 0] = '\0';
    close(ends[0]);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

static void in_a_call(int number)
{
    base_guard_enable();
    base_guard_begin("outer", BASE_GUARD_CALLS);
    base_guard_begin("inner", BASE_GUARD_CALLS);
    base_guard_end();
    raise(number);
}

static int deeper(volatile char *above)
{
    volatile char here[4096];
    here[0] = *above;
    return *above < 0 ? 0 : deeper(here) + here[0]; /* for ever, which the compiler does not know */
}

static void without_stack(int unused)
{
    char none = (char)unused;
    base_guard_enable();
    base_guard_begin("outer", BASE_GUARD_CALLS);
    deeper(&none);
}

static void with_last_words(int number)
{
    base_guard_enable();
    base_guard_begin("outer", BASE_GUARD_LOADING);
    (void)!write(STDERR_FILENO, "terminate called\n", 17);
    raise(number);
}

static void waiting(int seconds)
{
    base_guard_enable();
    base_guard_begin("outer", BASE_GUARD_START);
    for (int i = 0; i < seconds; i++)
        raise(SIGALRM); /* as the timer does each second */
}

static void behind_it(int number)
{
    base_guard_enable();
    base_guard_begin("outer", BASE_GUARD_LOADING);
    base_guard_end();
    (void)!write(STDERR_FILENO, "heard", 5);
    raise(number);
}

static void unasked(int number)
{
    base_guard_begin("outer", BASE_GUARD_CALLS); /* a renderer's process: its own affair */
    raise(number);
}

static void a_death_is_a_line_and_a_status(void **state)
{
    (void)state;
    char said[512];
    if (SANITIZED)
        skip();
    for (size_t i = 0; i < sizeof by_signal / sizeof by_signal[0]; i++) {
        assert_int_equal(child_of(in_a_call, by_signal[i], said, sizeof said), 1);
        assert_string_equal(said, "base_guard: out of memory, or a fault there (outer)\n");
        assert_int_equal(child_of(with_last_words, by_signal[i], said, sizeof said), 1);
        assert_string_equal(said, "base_guard: out of memory, or a fault there (outer)\n");
    }
    assert_int_equal(child_of(without_stack, 0, said, sizeof said), 1);
    assert_string_equal(said, "base_guard: out of memory, or a fault there (outer)\n");
}

static void a_start_takes_a_minute_at_most(void **state)
{
    (void)state;
    char said[512];
    if (SANITIZED)
        skip();
    assert_int_equal(child_of(waiting, 59, said, sizeof said), 77);
    assert_string_equal(said, "");
    assert_int_equal(child_of(waiting, 60, said, sizeof said), 1);
    assert_string_equal(said, "base_guard: out of memory, or a fault there (outer)\n");
}

static void elsewhere_a_process_dies_as_ever(void **state)
{
    (void)state;
    char said[512];
    if (SANITIZED)
        skip();
    assert_int_equal(child_of(behind_it, SIGSEGV, said, sizeof said), 128 + SIGSEGV);
    assert_string_equal(said, "heard");
    assert_int_equal(child_of(unasked, SIGABRT, said, sizeof said), 128 + SIGABRT);
    assert_string_equal(said, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_death_is_a_line_and_a_status),
        cmocka_unit_test(a_start_takes_a_minute_at_most),
        cmocka_unit_test(elsewhere_a_process_dies_as_ever),
    };
    return cmocka_run_group_tests_name("guard", tests, NULL, NULL);
}
