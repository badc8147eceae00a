/*
 * A transcript: what a test was told, line by line, compared whole with tests/unit/transcripts/NAME.txt (support/approve.h).
 */
#ifndef TESTS_GGN_TRANSCRIPT_H
#define TESTS_GGN_TRANSCRIPT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "support/approve.h"

struct transcript {
    FILE *file; /* write here */
    char *text;
    size_t size;
};

static inline FILE *transcript_begin(struct transcript *t)
{
    *t = (struct transcript){0};
    t->file = open_memstream(&t->text, &t->size);
    assert_non_null(t->file);
    return t->file;
}

/* Replaces what differs from run to run. */
static inline void transcript_hide(struct transcript *t, const char *what, const char *word)
{
    char *made = NULL;
    size_t size = 0;
    fflush(t->file);
    FILE *f = open_memstream(&made, &size);
    for (const char *p = t->text, *at; *p; p = at + strlen(what)) {
        at = strstr(p, what);
        if (!at) {
            fputs(p, f);
            break;
        }
        fprintf(f, "%.*s%s", (int)(at - p), p, word);
    }
    fclose(f);
    rewind(t->file);
    fputs(made, t->file);
    fflush(t->file);
    t->text[size] = '\0';
    free(made);
}

static inline void transcript_end(struct transcript *t, const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "tests/unit/transcripts/%s.txt", name);
    fclose(t->file);
    approve_text(path, t->text);
    free(t->text);
}

#endif
