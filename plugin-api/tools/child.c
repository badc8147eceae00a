/* SPDX-License-Identifier: MIT */
#define _DEFAULT_SOURCE 1 /* MAP_ANONYMOUS */
#include "child.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"

/* LeakSanitizer's, in its builds. */
__attribute__((weak)) int __lsan_do_recoverable_leak_check(void);

static pthread_mutex_t report_mutex = PTHREAD_MUTEX_INITIALIZER;

static void report_line(struct lc *c, char kind, const char *format, va_list args)
{
    char line[LC_LINE_SIZE];
    line[0] = kind;
    int length = vsnprintf(line + 1, sizeof line - 2, format, args);
    size_t size = length < 0 ? 0 : (size_t)length < sizeof line - 2 ? (size_t)length : sizeof line - 3;
    for (size_t i = 1; i <= size; i++)
        if (line[i] == '\n')
            line[i] = ' ';
    line[size + 1] = '\n';
    pthread_mutex_lock(&report_mutex);
    c->failed |= kind == 'F';
    if (write(c->report_fd, line, size + 2) < 0)
        c->failed = 1; /* the parent is gone */
    pthread_mutex_unlock(&report_mutex);
}

#define REPORT_FUNCTION(name, kind) \
    void name(struct lc *c, const char *format, ...) \
    { \
        va_list args; \
        va_start(args, format); \
        report_line(c, kind, format, args); \
        va_end(args); \
    }
REPORT_FUNCTION(lc_fail, 'F')
REPORT_FUNCTION(lc_note, 'N')
REPORT_FUNCTION(lc_skip, 'S')
REPORT_FUNCTION(lc_refuse, 'R')

void lc_doing(struct lc *c, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(c->doing, LC_LINE_SIZE, format, args);
    va_end(args);
}

_Noreturn static void child_main(struct lc *c, void (*fn)(struct lc *c, const void *arg), const void *arg)
{
    fn(c, arg);
    if (__lsan_do_recoverable_leak_check && __lsan_do_recoverable_leak_check() != 0)
        lc_fail(c, "LeakSanitizer found leaks");
    if (write(c->report_fd, "D\n", 2) != 2)
        _exit(1);
    _exit(0); /* no atexit handlers: they are the library's business, and it is never unloaded */
}

__attribute__((format(printf, 3, 4))) static void keep(struct lc_report *r, char kind, const char *format, ...)
{
    va_list args;
    r->failures += kind == 'F';
    r->skipped |= kind == 'S';
    r->refused |= kind == 'R';
    if (r->line_count == LC_LINES_MAX) {
        r->lines_left_out++;
        return;
    }
    r->kind[r->line_count] = kind;
    va_start(args, format);
    vsnprintf(r->lines[r->line_count++], LC_LINE_SIZE, format, args);
    va_end(args);
}

/* Takes lines until the child closes the pipe; 0 if it did not in time. */
static int read_lines(int fd, unsigned limit_s, struct lc_report *report)
{
    char line[LC_LINE_SIZE + 1];
    size_t filled = 0;
    const double end_s = base_clock_wall_s() + limit_s;
    for (;;) {
        const double left_s = end_s - base_clock_wall_s();
        struct pollfd p = {.fd = fd, .events = POLLIN};
        int ready = left_s > 0 ? poll(&p, 1, (int)(1e3 * left_s)) : 0;
        if (ready < 0 && errno == EINTR)
            continue;
        if (ready <= 0)
            return 0;
        ssize_t got = read(fd, line + filled, LC_LINE_SIZE - filled);
        if (got <= 0)
            return 1;
        filled += (size_t)got;
        line[filled] = '\0';
        for (char *eol; (eol = memchr(line, '\n', filled)) != NULL;) {
            *eol = '\0';
            if (line[0] == 'D')
                report->completed = 1;
            else
                keep(report, line[0], "%s", line + 1);
            size_t used = (size_t)(eol - line) + 1;
            memmove(line, eol + 1, filled - used);
            filled -= used;
        }
        if (filled == LC_LINE_SIZE)
            filled = 0;
    }
}

/* What the child wrote to its standard streams is a failure, and often the sanitizer's explanation of one. */
static void keep_output(FILE *output, struct lc_report *report)
{
    char text[LC_LINE_SIZE];
    int lines = 0;
    rewind(output);
    while (lines < 12 && fgets(text, sizeof text, output)) {
        text[strcspn(text, "\n")] = '\0';
        if (text[0] == '\0' || text[0] == '=')
            continue;
        if (lines++ == 0)
            keep(report, 'F', "it printed:");
        keep(report, 'N', "%s", text);
    }
}

/* Waits for the child and says how it ended, what it was at if that was no good end, and what it printed. */
static void gather(struct lc *c, pid_t pid, int fd, unsigned limit_s, FILE *output, struct lc_report *report)
{
    int status = 0, in_time = read_lines(fd, limit_s, report);
    if (!in_time)
        kill(pid, SIGKILL);
    waitpid(pid, &status, 0);
    if (!in_time)
        keep(report, 'F', "it hangs: it did not end within %u s", limit_s);
    else if (WIFSIGNALED(status))
        keep(report, 'F', "it crashed: %s", strsignal(WTERMSIG(status)));
    else if (!report->completed)
        keep(report, 'F', "it ended the process (exit status %d)", WEXITSTATUS(status));
    if (!report->completed && c->doing[0] != '\0')
        keep(report, 'N', "%s", c->doing);
    keep_output(output, report);
}

int lc_child_run(struct lc *c, void (*fn)(struct lc *c, const void *arg), const void *arg, unsigned limit_s,
                 struct lc_report *report)
{
    int ends[2];
    *report = (struct lc_report){0};
    FILE *output = tmpfile();
    c->doing = mmap(NULL, LC_LINE_SIZE, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (!output || c->doing == MAP_FAILED || pipe(ends) != 0) {
        if (output)
            fclose(output);
        if (c->doing != MAP_FAILED)
            munmap(c->doing, LC_LINE_SIZE);
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
        c->report_fd = ends[1];
        child_main(c, fn, arg);
    }
    close(ends[1]);
    if (pid > 0)
        gather(c, pid, ends[0], limit_s, output, report);
    close(ends[0]);
    fclose(output);
    munmap(c->doing, LC_LINE_SIZE);
    return pid > 0 ? 0 : -1;
}
