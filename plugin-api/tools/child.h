/* SPDX-License-Identifier: MIT
 *
 * Runs a function in a child process and gathers what it reports, prints, and how it ends.
 */
#ifndef LULL_CHECK_CHILD_H
#define LULL_CHECK_CHILD_H

#include "check.h"

#include <stdio.h>

enum { LC_LINES_MAX = 24, LC_LINE_SIZE = 800 };

struct lc_report {
    int failures;
    int skipped;
    int refused;    /* what the command line asks for cannot be done */
    int completed;  /* the function returned */
    int line_count; /* lines kept, failures first come first served */
    int lines_left_out;
    char kind[LC_LINES_MAX]; /* 'F'ailure, 'N'ote, 'S'kip, 'R'efusal */
    char lines[LC_LINES_MAX][LC_LINE_SIZE];
};

/* Forks; the child calls fn(c, arg) with c->report_fd set, the parent waits, at most limit_s. What the child prints, or a
 * signal that ends it, is a failure; what lc_doing said last is then noted. Returns 0, or -1 if no process could be made.
 * Not thread safe. */
int lc_child_run(struct lc *c, void (*fn)(struct lc *c, const void *arg), const void *arg, unsigned limit_s,
                 struct lc_report *report);

#endif
