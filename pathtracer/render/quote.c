#include "render/quote.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "render/host.h"
#include "render/host_planes.h"

static int told(int32_t code, const struct lull_error *said, struct base_err *err)
{
    return code == LULL_OK ? 0 : pt_host_fail(code, said, err);
}

static int add_row(struct pt_quote *q, double visible, const char *name, int asked, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    char value[32];
    const struct lull_pair changed = {"visible", value};
    snprintf(value, sizeof value, "%.17g", visible);
    q->settings[q->row_count++] = (struct pt_quote_setting){visible, name};
    return told(lull_host_quote_add(q->told, isnan(visible) ? NULL : &changed, asked, &e), &e, err);
}

/* Rows by falling share, the one that the options ask for among them; its share is NaN, and it comes first, when the
 * criterion has no such parameter or no value for it. */
static int add_rows(struct pt_quote *q, const struct lull_param *parameter, double asked, struct base_err *err)
{
    struct pt_quote_setting shares[] = {{0.5, "draft"}, {0.25, "default"}, {0.05, "final"}};
    int met = isnan(asked), rc = met ? add_row(q, asked, "as asked", 1, err) : 0;
    if (!parameter || rc)
        return rc;
    if (!base_parse_real(parameter->default_value, 0.05, 0.5, &shares[1].visible)) /* a model's own */
        shares[1].name = "normal";
    for (size_t i = 0; i < sizeof shares / sizeof shares[0] && !rc; i++) {
        const double share = shares[i].visible;
        if (!met && asked > share)
            rc = add_row(q, asked, "as asked", met = 1, err);
        met |= asked == share;
        if (!rc)
            rc = add_row(q, share, shares[i].name, asked == share, err);
    }
    return rc || met ? rc : add_row(q, asked, "as asked", 1, err);
}

/* The two pictures, as asked: rows for other shares would denoise each block once more. */
static int add_pictures(struct pt_quote *q, const struct pt_render *r, const struct lull_criterion *noisy, double asked,
                        struct base_log *log, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_criterion *judge;
    int rc = add_row(q, asked, "denoised", 1, err);
    if (!rc)
        rc = pt_criterion_create(noisy, NULL, 0, r->threads, log, &judge, err);
    if (rc)
        return rc;
    q->settings[q->row_count++] = (struct pt_quote_setting){asked, "noisy"};
    return told(lull_host_quote_add_other(q->told, judge, &e), &e, err);
}

int pt_quote_create(const struct pt_render *r, const struct lull_pair *pairs, uint32_t pair_count,
                    const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    const struct lull_param *parameter = NULL;
    const char *text =
        r->criterion ? lull_host_parameter(lull_host_table(r->criterion), "visible", pairs, pair_count, &parameter) : NULL;
    double asked;
    if (!text || !base_parse_real(text, 0, 1, &asked))
        asked = (double)NAN;
    struct pt_quote *q = calloc(1, sizeof *q);
    if (!q)
        return base_fail_nomem(err, "quote");
    q->threads = pt_render_threads(r);
    int rc = told(lull_host_quote_begin(r->frame, q->threads, &q->told, &e), &e, err);
    if (!rc)
        rc = noisy ? add_pictures(q, r, noisy, asked, log, err) : add_rows(q, parameter, asked, err);
    if (rc) {
        pt_quote_destroy(q);
        return rc;
    }
    *out = q;
    return 0;
}

void pt_quote_destroy(struct pt_quote *q)
{
    if (q)
        lull_host_quote_end(q->told);
    free(q);
}

void pt_quote_ask(struct pt_quote *q, struct pt_render *r, const uint32_t *due, uint32_t count)
{
    struct pt_host_view show;
    lull_host_quote_ask(q->told, pt_host_show(&r->film, r->blocks, &show), due, count);
}

int pt_quote_finish(struct pt_quote *q, struct pt_render *r, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct pt_host_view show;
    const struct lull_host_view *view = pt_host_show(&r->film, r->blocks, &show);
    return told(lull_host_quote_finish(q->told, view, &q->rows, &q->row_count, &e), &e, err);
}
