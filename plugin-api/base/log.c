#include "base/log.h"

#include <stdarg.h>
#include <unistd.h>

void base_log_init(struct base_log *log, FILE *out, const char *name, int quiet)
{
    *log = (struct base_log){.out = out, .name = name, .quiet = quiet, .terminal = out && isatty(fileno(out)) == 1};
}

void base_log_clear(struct base_log *log)
{
    if (log && log->live) {
        fputs("\r\033[K", log->out);
        fflush(log->out);
        log->live = 0;
    }
}

/* As a whole: other processes may write to the same place. */
static void write_line(struct base_log *log, const char *format, va_list args)
{
    char text[4000];
    if (!log || !log->out)
        return;
    vsnprintf(text, sizeof text, format, args);
    flockfile(log->out);
    base_log_clear(log);
    fprintf(log->out, "%s%s%s\n", log->name ? log->name : "", log->name ? ": " : "", text);
    funlockfile(log->out);
}

void base_log_say(struct base_log *log, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    write_line(log, format, args);
    va_end(args);
}

void base_log_note(struct base_log *log, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (log && !log->quiet)
        write_line(log, format, args);
    va_end(args);
}

void base_log_live(struct base_log *log, const char *text)
{
    if (!log || !log->out || log->quiet)
        return;
    flockfile(log->out);
    fprintf(log->out, log->terminal ? "\r%s\033[K" : "%s\n", text);
    fflush(log->out);
    log->live = log->terminal;
    funlockfile(log->out);
}
