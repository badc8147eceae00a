#include "render/quote.h"

#include <stdlib.h>

int pt_quote_create(const struct pt_render *r, const struct lull_criterion *noisy, struct pt_quote **out,
                    struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct pt_quote *q = calloc(1, sizeof *q);
    if (!q)
        return base_fail_nomem(err, "quote");
    q->threads = pt_render_threads(r);
    int32_t code = lull_host_quote_begin(r->frame, q->threads, &q->quote, &e);
    if (code == LULL_OK)
        code = lull_host_quote_usual(q->quote, noisy, &e);
    if (code != LULL_OK) {
        pt_quote_destroy(q);
        return pt_host_result(code, &e, err);
    }
    *out = q;
    return 0;
}

void pt_quote_destroy(struct pt_quote *q)
{
    if (q)
        lull_host_quote_end(q->quote);
    free(q);
}

int pt_quote_finish(struct pt_quote *q, struct pt_render *r, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    return pt_host_result(lull_host_quote_finish(q->quote, &r->shown.view, &q->rows, &q->row_count, &e), &e, err);
}

const struct lull_host_quote_row *pt_quote_asked(const struct pt_quote *q)
{
    int i = 0;
    while (!q->rows[i].asked)
        i++;
    return &q->rows[i];
}
