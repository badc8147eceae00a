#include "base/log.h"

#include <stdarg.h>
#include <sys/ioctl.h>
#include <unistd.h>

void base_log_init(struct base_log *log, FILE *out, const char *name, int quiet)
{
    *log = (struct base_log){.out = out, .name = name, .quiet = quiet, .terminal = out && isatty(fileno(out)) == 1};
}

void base_log_size(const struct base_log *log, int *columns, int *lines)
{
    struct winsize size;
    int known = log->out && ioctl(fileno(log->out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
    *columns = known ? size.ws_col : 80;
    *lines = known ? size.ws_row : 24;
}

/* To the beginning of what is live. Terminals that have become narrower have broken its lines. */
static void go_back(const struct base_log *log)
{
    if (log->live > 1) {
        int columns, lines;
        base_log_size(log, &columns, &lines);
        int up = log->live * (log->live_columns > columns ? (log->live_columns + columns - 1) / columns : 1) - 1;
        fprintf(log->out, "\033[%dA\r\033[J", up < lines ? up : lines - 1);
    } else
        fputc('\r', log->out);
}

void base_log_clear(struct base_log *log)
{
    if (log && log->live) {
        go_back(log);
        fputs("\033[K", log->out);
        fflush(log->out);
        log->live = 0;
    }
}

/* Lines of a text, and characters of its longest: neither escapes (up to their letter) nor the rest of a UTF-8 sequence. */
static int measure(const char *text, int *columns)
{
    int lines = 1, length = 0;
    *columns = 0;
    for (const char *c = text; *c; c++) {
        if (*c == '\033') {
            while (c[1] && !(*c >= 'a' && *c <= 'z') && !(*c >= 'A' && *c <= 'Z'))
                c++;
        } else if (*c == '\n') {
            lines++;
            length = 0;
        } else if ((*c & 0xc0) != 0x80)
            length++;
        *columns = length > *columns ? length : *columns;
    }
    return lines;
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
    if (log->terminal) {
        go_back(log);
        fprintf(log->out, "%s\033[K", text);
        log->live = measure(text, &log->live_columns);
    } else
        fprintf(log->out, "%s\n", text);
    fflush(log->out);
    funlockfile(log->out);
}
