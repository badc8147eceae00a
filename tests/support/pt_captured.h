/* A log that is kept in memory: the lines so far are in text. */
#ifndef TESTS_SUPPORT_PT_CAPTURED_H
#define TESTS_SUPPORT_PT_CAPTURED_H

#include "base/log.h"

struct captured {
    struct base_log log;
    char text[8192];
};

static inline void capture_begin(struct captured *h)
{
    *h = (struct captured){0};
    h->log.out = fmemopen(h->text, sizeof h->text, "w");
    setvbuf(h->log.out, NULL, _IONBF, 0);
}

static inline void capture_end(struct captured *h)
{
    fclose(h->log.out);
    h->log.out = NULL;
}

static inline int captured_lines(const struct captured *h)
{
    int n = 0;
    for (const char *at = h->text; *at != '\0'; at++)
        n += *at == '\n';
    return n;
}

#endif
