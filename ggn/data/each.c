#include "data/each.h"

#include <stdlib.h>

struct each {
    int (*fn)(void *data, long i, int worker, struct base_err *err);
    void *data;
    struct base_err *errs; /* [n] */
};

static void do_one(void *data, long i, int worker)
{
    struct each *e = data;
    e->errs[i].code = e->fn(e->data, i, worker, &e->errs[i]);
}

int ggn_each(struct base_threads *threads, long n, int (*fn)(void *data, long i, int worker, struct base_err *err),
             void *data, const char *what, struct base_err *err)
{
    struct each e = {fn, data, calloc(n > 0 ? (size_t)n : 1, sizeof *e.errs)};
    int rc = 0;
    if (!e.errs)
        return base_fail_nomem(err, what);
    base_threads_for(threads, n, do_one, &e);
    for (long i = 0; i < n && !rc; i++)
        if (e.errs[i].code != 0)
            rc = base_fail(err, e.errs[i].code, "%s", e.errs[i].text);
    free(e.errs);
    return rc;
}
