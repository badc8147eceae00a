/* The rows of a quote that people compare: which settings, coarse to fine, and what each is called. */
#include "host/frame.h"

#include <math.h>
#include <string.h>

#include <lull/criterion_kit.h>

struct setting {
    const char *parameter; /* static text; NULL: as the render is */
    double value;
    const char *name;
};

enum { COARSER = 3 }; /* of `times`, those coarser than what is just seen */
static const struct setting times[] = {
    {"error", 8, "rough"}, {"error", 4, "draft"}, {"error", 2, "good"}, {"error", 1, "just seen"}, {"error", 0.5, "strict"}};

static const char *const qualities[] = {"error", "visible", "threshold"};

const struct lull_param *lull_host_quality(const struct lull_criterion *t, const struct lull_pair *pairs,
                                           uint32_t pair_count, double *value)
{
    for (size_t i = 0; i < sizeof qualities / sizeof qualities[0]; i++) {
        const struct lull_param *p;
        const char *text = lull_host_parameter(t, qualities[i], pairs, pair_count, &p);
        double number;
        if (!text || !lull_kit_number(text, &number) || !(number >= p->min && number <= p->max))
            continue;
        if (value)
            *value = number;
        return p;
    }
    return NULL;
}

/* Can this number be set? */
static int takes(const struct lull_param *p, double value)
{
    return p && p->type == LULL_PARAM_FLOAT && value >= p->min && value <= p->max;
}

static int32_t add(struct lull_host_quote *q, struct setting s, int asked, struct lull_error *err)
{
    char text[32];
    const struct lull_pair changed = {s.parameter, text};
    int32_t code;
    if (!lull_host_number(s.value, text))
        return lull_host_no_memory(err, "quote");
    if (!asked && strcmp(s.parameter, "error") == 0)
        code = lull_host_quote_add_error(q, s.value, err);
    else
        code = lull_host_quote_add(q, s.parameter && !asked ? &changed : NULL, asked, err);
    if (code == LULL_OK) {
        struct lull_host_quote_asked *a = &q->asked[q->count - 1];
        a->parameter = s.parameter;
        a->value = s.value;
        a->name = s.name;
    }
    return code;
}

/* Rows by falling value, the one that was asked for among them unless it has its row already (*met). */
static int32_t add_falling(struct lull_host_quote *q, const struct lull_param *p, const struct setting *rows, size_t count,
                           struct setting asked, int *met, struct lull_error *err)
{
    int32_t code = LULL_OK;
    for (size_t i = 0; i < count && code == LULL_OK; i++) {
        const int same = !*met && asked.value == rows[i].value;
        if (!*met && asked.value > rows[i].value)
            code = add(q, asked, *met = 1, err);
        *met |= same;
        if (code == LULL_OK && (same || takes(p, rows[i].value)))
            code = add(q, rows[i], same, err);
    }
    return code;
}

/* Without a quality parameter that is set the row of the render comes first. */
static int32_t add_usual(struct lull_host_quote *q, const struct lull_param *visible, const struct lull_param *error,
                         const struct lull_param *set, struct setting asked, struct lull_error *err)
{
    struct setting shares[] = {{"visible", 0.5, "draft"}, {"visible", 0.25, "normal"}, {"visible", 0.05, "strict"}};
    const int by_error = asked.parameter && strcmp(asked.parameter, "error") == 0;
    const int by_share = !asked.parameter || strcmp(asked.parameter, "visible") == 0;
    const struct setting coarse[] = {{asked.parameter, 4 * asked.value, "rough"},
                                     {asked.parameter, 2 * asked.value, "draft"}};
    int met = !asked.parameter, coarser = 1;
    int32_t code = met ? add(q, asked, 1, err) : LULL_OK;
    double own;
    if (visible && visible->default_value && lull_kit_number(visible->default_value, &own) && own >= 0.05 && own <= 0.5)
        shares[1] = (struct setting){"visible", own, "default"};
    if (code == LULL_OK && by_error)
        code = add_falling(q, error, times, sizeof times / sizeof times[0], asked, &met, err);
    else if (code == LULL_OK && by_share)
        code = add_falling(q, error, times, COARSER, asked, &coarser, err);
    if (code == LULL_OK && !by_share && !by_error)
        code = add_falling(q, set, coarse, 2, asked, &met, err);
    if (code == LULL_OK && by_share && visible)
        code = add_falling(q, visible, shares + (error != NULL), 3 - (error != NULL), asked, &met, err);
    return code != LULL_OK || met ? code : add(q, asked, 1, err);
}

/* What is kept, as asked and coarser, and the noisy picture. Rows for other shares would denoise each block once more. */
static int32_t add_pictures(struct lull_host_quote *q, const struct lull_criterion *noisy, const struct lull_param *error,
                            struct setting asked, struct lull_error *err)
{
    const struct lull_host_criterion *own = q->frame->criterion;
    struct lull_host_services services = own->offered;
    struct lull_host_criterion *judge;
    char text[32];
    const struct lull_pair quality = {asked.parameter, text};
    int met = !asked.parameter;
    services.struct_size = sizeof services;
    services.release = NULL; /* the context is the frame's criterion's */
    asked.name = "denoised";
    int32_t code = lull_host_number(asked.value, text) ? LULL_OK : lull_host_no_memory(err, "quote");
    if (code == LULL_OK)
        code = add_falling(q, error, times, error ? COARSER : 0, asked, &met, err);
    if (code == LULL_OK && (!met || !asked.parameter))
        code = add(q, asked, 1, err);
    if (code == LULL_OK)
        code = lull_host_create(&services, noisy, &quality, asked.parameter != NULL, &judge, err);
    if (code == LULL_OK)
        code = lull_host_quote_add_other(q, judge, err);
    if (code == LULL_OK) {
        struct lull_host_quote_asked *a = &q->asked[q->count - 1];
        a->parameter = asked.parameter;
        a->value = asked.value;
        a->name = "noisy";
    }
    return code;
}

int32_t lull_host_quote_usual(struct lull_host_quote *q, const struct lull_criterion *noisy, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "quote", q, NULL);
    if (code != LULL_OK)
        return code;
    const struct lull_host_criterion *own = q->frame->criterion;
    struct setting asked = {NULL, (double)NAN, "as asked"};
    const struct lull_param *known[2] = {NULL, NULL};
    for (int i = 0; i < 2 && own; i++)
        lull_host_parameter(own->table, qualities[i], NULL, 0, &known[i]);
    const struct lull_param *set = own ? lull_host_quality(own->table, own->pairs, own->pair_count, &asked.value) : NULL;
    if (set)
        asked.parameter = set->name;
    if (noisy && own && strcmp(own->table->id, "denoised") == 0)
        return add_pictures(q, noisy, known[0], asked, err);
    return add_usual(q, known[1], known[0], set, asked, err);
}
