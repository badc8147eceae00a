/*
 * What a program tells people while it works: lines on one stream, and a live line of progress below them that a terminal
 * redraws in place. Say is for what must be known, note for what --quiet leaves out, as it does progress. A log of NULL
 * or without a stream is silent: in a job of several processes one of them has a stream. Any thread may say and note; the
 * live line belongs to one.
 */
#ifndef BASE_LOG_H
#define BASE_LOG_H

#include <stdio.h>

struct base_log {
    FILE *out;        /* borrows; NULL: silent */
    const char *name; /* of the program, before each line; NULL: lines as they are */
    int quiet;        /* neither notes nor progress */
    int terminal;     /* out is one */
    int live;         /* live lines that stand there */
    int live_columns; /* characters of the longest of them */
};

void base_log_init(struct base_log *log, FILE *out, const char *name, int quiet);

/* One line, without its newline. Longer ones are cut after 4,000 bytes. */
void base_log_say(struct base_log *log, const char *format, ...) __attribute__((format(printf, 2, 3)));
void base_log_note(struct base_log *log, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Columns and lines of the terminal; 80 and 24 where it does not say. */
void base_log_size(const struct base_log *log, int *columns, int *lines);

/* Progress: in the place of what is live on a terminal, elsewhere a line like others, without the name. On a terminal text
 * may have several lines, none longer than the terminal is wide, and colours that end with each. */
void base_log_live(struct base_log *log, const char *text);
/* Takes what is live away, before the stream is used by others. */
void base_log_clear(struct base_log *log);

#endif
