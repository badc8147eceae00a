/*
 * A transcript: what a test was told, line by line, compared whole with tests/golden/whole/NAME.txt as support/ggn_approve.h does.
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

#include "support/ggn_approve.h"

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
    char whole[128];
    snprintf(whole, sizeof whole, "whole/%s", name);
    fclose(t->file);
    ggn_approve(whole, t->text, 0);
    free(t->text);
}

#endif
