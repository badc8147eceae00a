#define _GNU_SOURCE /* RTLD_DEFAULT, program_invocation_short_name */
#include "base/guard.h"

#include <dlfcn.h>
#include <errno.h> /* program_invocation_short_name */
#include <execinfo.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

static const int deaths[] = {SIGSEGV, SIGBUS, SIGILL, SIGTRAP, SIGABRT, SIGALRM};
enum { DEATHS = sizeof deaths / sizeof deaths[0], START_S = 60, FAILED = 1, STACK_BYTES = 1 << 16 };

static struct {
    pthread_mutex_t lock;
    int enabled, depth;
    int errors; /* standard error, behind what is silenced; -1: nothing is */
    char line[256];
    struct sigaction before[DEATHS];
    volatile sig_atomic_t left_s;
    char stack[STACK_BYTES]; /* for who dies of having none left */
} guard = {.lock = PTHREAD_MUTEX_INITIALIZER, .errors = -1};

static void say_and_end(void)
{
    (void)!write(guard.errors >= 0 ? guard.errors : STDERR_FILENO, guard.line, strlen(guard.line));
    _exit(FAILED);
}

/* SIGALRM comes each second, but not while the process is stopped. */
static void on_death(int number)
{
    if (number != SIGALRM || --guard.left_s <= 0)
        say_and_end();
}

/* std::set_terminate: a program in C has it by the libraries that are in C++, or needs none. */
static void set_terminate(void (*handler)(void))
{
    void (*(*set)(void (*)(void)))(void);
    void *symbol = dlsym(RTLD_DEFAULT, "_ZSt13set_terminatePFvvE");
    memcpy(&set, &symbol, sizeof set); /* a pointer to data into one to a function */
    if (set)
        set(handler);
}

static void name_line(const char *what)
{
    snprintf(guard.line, sizeof guard.line, "%s: out of memory, or a fault there (%s)\n", program_invocation_short_name,
             what);
}

static void tick_every(int seconds)
{
    const struct itimerval timer = {{seconds, 0}, {seconds, 0}};
    setitimer(ITIMER_REAL, &timer, NULL);
}

static void silence(void)
{
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    fflush(stderr);
    if (nowhere >= 0 && (guard.errors = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)) >= 0)
        dup2(nowhere, STDERR_FILENO);
    if (nowhere >= 0)
        close(nowhere);
}

void base_guard_enable(void)
{
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) /* which tell more of a fault */
    guard.enabled = 1;
#endif
}

void base_guard_begin(const char *what, enum base_guard how)
{
    struct sigaction action = {.sa_handler = on_death, .sa_flags = SA_RESTART | SA_ONSTACK};
    const stack_t stack = {.ss_sp = guard.stack, .ss_size = STACK_BYTES};
    void *frame;
    sigemptyset(&action.sa_mask);
    pthread_mutex_lock(&guard.lock);
    if (guard.enabled && guard.depth++ == 0) {
        name_line(what);
        guard.left_s = START_S;
        (void)backtrace(&frame, 1); /* loads what exceptions need: without memory that says a line of its own */
        sigaltstack(&stack, NULL);
        for (int i = 0; i < DEATHS; i++)
            sigaction(deaths[i], &action, &guard.before[i]);
        set_terminate(say_and_end);
        if (how == BASE_GUARD_LOADING)
            silence();
        else if (how == BASE_GUARD_START)
            tick_every(1);
    }
    pthread_mutex_unlock(&guard.lock);
}

void base_guard_end(void)
{
    pthread_mutex_lock(&guard.lock);
    if (guard.enabled && --guard.depth == 0) {
        tick_every(0);
        if (guard.errors >= 0) {
            dup2(guard.errors, STDERR_FILENO);
            close(guard.errors);
            guard.errors = -1;
        }
        name_line("a library"); /* whose threads may still die by std::terminate */
        for (int i = 0; i < DEATHS; i++)
            sigaction(deaths[i], &guard.before[i], NULL);
    }
    pthread_mutex_unlock(&guard.lock);
}
