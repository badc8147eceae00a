#include "render/quote.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"

enum { COARSER = 3 }; /* of `times`, those coarser than what is just seen */
static const struct pt_quote_setting times[] = {
    {"error", 8, "rough"}, {"error", 4, "draft"}, {"error", 2, "good"}, {"error", 1, "just seen"}, {"error", 0.5, "strict"}};

static int add_row(struct pt_quote *q, struct pt_quote_setting setting, int asked, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    char value[32];
    const struct lull_pair changed = {setting.parameter, value};
    snprintf(value, sizeof value, "%.17g", setting.value);
    q->settings[q->row_count++] = setting;
    if (!asked && setting.parameter && strcmp(setting.parameter, "error") == 0)
        return pt_host_result(lull_host_quote_add_error(q->quote, setting.value, &e), &e, err);
    return pt_host_result(lull_host_quote_add(q->quote, setting.parameter ? &changed : NULL, asked, &e), &e, err);
}

/* Rows by falling value, the one that the options ask for among them unless it has its row already (*met). */
static int add_falling(struct pt_quote *q, const struct pt_quote_setting *rows, size_t count, struct pt_quote_setting asked,
                       int *met, struct base_err *err)
{
    int rc = 0;
    for (size_t i = 0; i < count && !rc; i++) {
        const int same = !*met && asked.value == rows[i].value;
        if (!*met && asked.value > rows[i].value)
            rc = add_row(q, asked, *met = 1, err);
        *met |= same;
        if (!rc)
            rc = add_row(q, rows[i], same, err);
    }
    return rc;
}

/* asked.parameter is NULL when the criterion has no quality parameter, or no value for it; then its row comes first. */
static int add_rows(struct pt_quote *q, const struct lull_param *visible, const struct lull_param *error,
                    struct pt_quote_setting asked, struct base_err *err)
{
    struct pt_quote_setting shares[] = {
        {"visible", 0.5, "draft"}, {"visible", 0.25, "default"}, {"visible", 0.05, "strict"}};
    const int by_error = asked.parameter && strcmp(asked.parameter, "error") == 0;
    int met = !asked.parameter, coarser = 1, rc = met ? add_row(q, asked, 1, err) : 0;
    if (!visible || rc)
        return rc;
    if (!base_parse_real(visible->default_value, 0.05, 0.5, &shares[1].value)) /* a model's own */
        shares[1].name = "normal";
    if (by_error)
        rc = add_falling(q, times, sizeof times / sizeof times[0], asked, &met, err);
    else if (error)
        rc = add_falling(q, times, COARSER, asked, &coarser, err);
    if (!rc && !by_error)
        rc = add_falling(q, shares + (error != NULL), 3 - (error != NULL), asked, &met, err);
    return rc || met ? rc : add_row(q, asked, 1, err);
}

/* What is kept, as asked and coarser, and the noisy picture. Rows for other shares would denoise each block once more. */
static int add_pictures(struct pt_quote *q, const struct pt_render *r, const struct lull_criterion *noisy,
                        const struct lull_param *error, struct pt_quote_setting asked, struct base_log *log,
                        struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_criterion *judge;
    int met = 0;
    asked.name = "denoised";
    int rc = add_falling(q, times, error ? COARSER : 0, asked, &met, err);
    if (!rc && !met)
        rc = add_row(q, asked, 1, err);
    char value[32];
    const struct lull_pair quality = {asked.parameter, value};
    snprintf(value, sizeof value, "%.17g", asked.value);
    if (!rc)
        rc = pt_criterion_create(noisy, &quality, asked.parameter != NULL, r->threads, log, &judge, err);
    if (rc)
        return rc;
    asked.name = "noisy";
    q->settings[q->row_count++] = asked;
    return pt_host_result(lull_host_quote_add_other(q->quote, judge, &e), &e, err);
}

int pt_quote_create(const struct pt_render *r, const struct lull_pair *pairs, uint32_t pair_count,
                    const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    const struct lull_param *known[2] = {NULL, NULL};
    static const char *const names[2] = {"error", "visible"};
    struct pt_quote_setting asked = {NULL, (double)NAN, "as asked"};
    for (int i = 0; i < 2 && r->criterion; i++) {
        const char *text = lull_host_parameter(lull_host_table(r->criterion), names[i], pairs, pair_count, &known[i]);
        if (!asked.parameter && text && base_parse_real(text, 0, 100, &asked.value))
            asked.parameter = names[i];
    }
    struct pt_quote *q = calloc(1, sizeof *q);
    if (!q)
        return base_fail_nomem(err, "quote");
    q->threads = pt_render_threads(r);
    int rc = pt_host_result(lull_host_quote_begin(r->frame, q->threads, &q->quote, &e), &e, err);
    if (!rc)
        rc = noisy ? add_pictures(q, r, noisy, known[0], asked, log, err) : add_rows(q, known[1], known[0], asked, err);
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
