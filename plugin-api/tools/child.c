/* SPDX-License-Identifier: MIT */
#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "check.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

/* LeakSanitizer's, in its builds. */
__attribute__((weak)) int __lsan_do_recoverable_leak_check(void);

void lc_say(struct lc *c, char kind, const char *format, ...)
{
    static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    struct lc_report *r = c->report;
    va_list args;
    pthread_mutex_lock(&mutex);
    r->failures += kind == 'F';
    r->skipped |= kind == 'S';
    r->refused |= kind == 'R';
    if (r->line_count < LC_LINES_MAX) {
        char *line = r->lines[r->line_count];
        va_start(args, format);
        vsnprintf(line, LC_LINE_SIZE, format, args);
        va_end(args);
        while ((line = strchr(line, '\n')))
            *line = ' ';
        r->kind[r->line_count++] = kind;
    } else {
        r->lines_left_out++;
    }
    pthread_mutex_unlock(&mutex);
}

/* Of the pipe that the child holds open while it lives; a byte in it means a good end. */
static int ends[2];

/* The end of a check. No atexit handlers: they are the library's business, and it is never unloaded. */
_Noreturn static void end(void) { _exit(write(ends[1], "", 1) != 1); }

void *lc_need(struct lc *c, void *memory)
{
    if (!memory) {
        lc_fail(c, "out of memory");
        end();
    }
    return memory;
}

void lc_doing(struct lc *c, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(c->report->doing, LC_LINE_SIZE, format, args);
    va_end(args);
}

/* Waits until the child's pipe is closed; 0: it was not in time. */
static int wait_for_end(unsigned limit_s, struct lc_report *report)
{
    const double end_s = base_clock_wall_s() + limit_s;
    for (;;) {
        const double left_s = end_s - base_clock_wall_s();
        struct pollfd p = {.fd = ends[0], .events = POLLIN};
        char byte;
        int ready = left_s > 0 ? poll(&p, 1, (int)(1e3 * left_s)) : 0;
        if (ready < 0 && errno == EINTR)
            continue;
        if (ready <= 0)
            return 0;
        if (read(ends[0], &byte, 1) <= 0)
            return 1;
        report->completed = 1;
    }
}

/* What the child wrote to its standard streams is a failure, and often the sanitizer's explanation of one. */
static void keep_output(struct lc *c, FILE *output)
{
    char text[LC_LINE_SIZE];
    int lines = 0;
    rewind(output);
    while (lines < 12 && fgets(text, sizeof text, output)) {
        text[strcspn(text, "\n")] = '\0';
        if (text[0] == '\0' || text[0] == '=')
            continue;
        if (lines++ == 0)
            lc_fail(c, "it printed:");
        lc_note(c, "%s", text);
    }
}

/* Waits for the child and says how it ended, what it was at if that was no good end, and what it printed. */
static void gather(struct lc *c, pid_t pid, unsigned limit_s, FILE *output)
{
    struct lc_report *r = c->report;
    int status = 0, in_time = wait_for_end(limit_s, r);
    if (!in_time)
        kill(pid, SIGKILL);
    waitpid(pid, &status, 0);
    /* whatever a broken library has written there */
    r->line_count = r->line_count < LC_LINES_MAX ? r->line_count : LC_LINES_MAX;
    for (int i = 0; i < LC_LINES_MAX; i++)
        r->lines[i][LC_LINE_SIZE - 1] = '\0';
    r->doing[LC_LINE_SIZE - 1] = '\0';
    if (!in_time)
        lc_fail(c, "it hangs: it did not end within %u s", limit_s);
    else if (WIFSIGNALED(status))
        lc_fail(c, "it crashed: %s", strsignal(WTERMSIG(status)));
    else if (!r->completed)
        lc_fail(c, "it ended the process (exit status %d)", WEXITSTATUS(status));
    if (!r->completed && r->doing[0] != '\0')
        lc_note(c, "%s", r->doing);
    keep_output(c, output);
}

int lc_child_run(struct lc *c, void (*fn)(struct lc *c, const void *arg), const void *arg, unsigned limit_s,
                 struct lc_report *report)
{
    FILE *output = tmpfile();
    c->report = mmap(NULL, sizeof *report, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (!output || c->report == MAP_FAILED || pipe(ends) != 0) {
        if (output)
            fclose(output);
        if (c->report != MAP_FAILED)
            munmap(c->report, sizeof *report);
        return -1;
    }
    fflush(stdout);
    const pid_t parent = getpid();
    pid_t pid = fork();
    if (pid == 0) {
        if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || getppid() != parent) /* who hangs ends with whoever waits for it */
            _exit(1);
        close(ends[0]);
        dup2(fileno(output), STDOUT_FILENO);
        dup2(fileno(output), STDERR_FILENO);
        fn(c, arg);
        if (__lsan_do_recoverable_leak_check && __lsan_do_recoverable_leak_check() != 0)
            lc_fail(c, "LeakSanitizer found leaks");
        end();
    }
    close(ends[1]);
    if (pid > 0)
        gather(c, pid, limit_s, output);
    close(ends[0]);
    fclose(output);
    *report = *c->report;
    munmap(c->report, sizeof *report);
    return pid > 0 ? 0 : -1;
}
