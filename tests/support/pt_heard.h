/* A log that is kept in memory: what was said so far is heard.text, a line each. */
#ifndef TESTS_SUPPORT_PT_HEARD_H
#define TESTS_SUPPORT_PT_HEARD_H

#include "base/log.h"

struct heard {
    struct base_log log;
    char text[8192];
};

static inline void hear_begin(struct heard *h)
{
    *h = (struct heard){0};
    h->log.out = fmemopen(h->text, sizeof h->text, "w");
    setvbuf(h->log.out, NULL, _IONBF, 0);
}

static inline void hear_end(struct heard *h)
{
    fclose(h->log.out);
    h->log.out = NULL;
}

static inline int heard_lines(const struct heard *h)
{
    int n = 0;
    for (const char *at = h->text; *at != '\0'; at++)
        n += *at == '\n';
    return n;
}

#endif
