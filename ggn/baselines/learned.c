#include "baselines/learned.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "baselines/lstm.h"
#include "data/each.h"
#include "data/replay.h"
#include "train/fit_policy.h"

/* --- features --- */

void ggn_feature_set_release(struct ggn_feature_set *t)
{
    free(t->first);
    free(t->x);
    *t = (struct ggn_feature_set){0};
}

/* A baseline at work on the blocks of a set. */
struct work {
    const struct ggn_eval_set *set;
    const struct ggn_baseline *baseline;
    const struct ggn_feature_set *features;
    struct ggn_method *method; /* gets the scores, once there are features */
};

static int extract_block(void *data, long index, int worker, struct base_err *err)
{
    const struct work *j = data;
    const struct ggn_level_series *c = &j->set->images.series[j->set->blocks[index].series];
    int w = j->set->images.width, h = j->set->images.height;
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(j->baseline, err);
    (void)worker;
    if (!r)
        return err->code;
    for (int i = 0; i < c->n_levels; i++)
        ggn_baseline_extract(r, c->noisy + ggn_series_set_values(&j->set->images) * (size_t)i, w, h,
                             j->features->x + (j->features->first[index] + (size_t)i) * j->features->size);
    ggn_baseline_reader_destroy(r);
    return 0;
}

int ggn_feature_set_make(struct ggn_feature_set *t, const struct ggn_baseline *b, const struct ggn_eval_set *s,
                         struct base_threads *threads, struct base_err *err)
{
    struct work j = {s, b, t, NULL};
    size_t rows = 0;
    *t = (struct ggn_feature_set){.size = ggn_baseline_feature_count(b, s->images.width, s->images.height),
                                  .first = malloc(((size_t)s->n_blocks + 1) * sizeof *t->first)};
    for (int k = 0; k < s->n_blocks && t->first; k++) {
        t->first[k] = rows;
        rows += (size_t)s->images.series[s->blocks[k].series].n_levels;
    }
    if (t->first)
        t->first[s->n_blocks] = rows;
    t->x = malloc(rows * t->size * sizeof *t->x);
    int rc = !t->first || !t->x ? base_fail_nomem(err, "baseline")
                                : ggn_each(threads, s->n_blocks, extract_block, &j, "evaluation", err);
    if (rc)
        ggn_feature_set_release(t);
    return rc;
}

/* --- training --- */

/* The cases of a split that have a label: where their window's features begin, [window][size] one after the other. */
struct cases {
    size_t n;
    const double **window;
    unsigned char *label;
};

static void cases_release(struct cases *c)
{
    free(c->window);
    free(c->label);
}

static int list_cases(struct cases *c, const struct ggn_baseline *b, const struct ggn_feature_set *t,
                      const struct ggn_eval_set *s, enum ggn_split split, struct base_err *err)
{
    size_t room = s->n > 0 ? s->n : 1, skipped = (size_t)(s->window - b->window);
    *c = (struct cases){.window = malloc(room * sizeof *c->window), .label = malloc(room)};
    if (!c->window || !c->label) {
        cases_release(c);
        return base_fail_nomem(err, "baseline");
    }
    for (int k = 0; k < s->n_blocks; k++)
        for (size_t i = s->blocks[k].first; i < s->blocks[k].end; i++)
            if (s->blocks[k].split == split && s->noisy[i] >= 0) {
                c->window[c->n] = t->x + (t->first[k] + (i - s->blocks[k].first) + skipped) * t->size;
                c->label[c->n++] = s->noisy[i] == 1;
            }
    return 0;
}

static int train_lstm(struct ggn_baseline *b, const struct cases *c, int epochs, struct base_err *err)
{
    size_t n = ggn_lstm_parameters(b->features);
    struct ggn_lstm *lstm = ggn_lstm_create(b->features, b->window, 7, err);
    if (!lstm)
        return err->code;
    for (int e = 0; e < epochs; e++)
        ggn_lstm_epoch(lstm, c->window, c->label, c->n, (uint32_t)e);
    b->lstm = malloc(n * sizeof *b->lstm);
    if (b->lstm)
        memcpy(b->lstm, ggn_lstm_weights(lstm), n * sizeof *b->lstm);
    ggn_lstm_destroy(lstm);
    return b->lstm ? 0 : base_fail_nomem(err, "LSTM");
}

static int train_svm(struct ggn_baseline *b, const struct cases *c, size_t size, struct base_err *err)
{
    double *x = malloc(c->n * size * sizeof *x);
    if (!x)
        return base_fail_nomem(err, "SVM");
    for (size_t i = 0; i < c->n; i++)
        memcpy(x + i * size, c->window[i], size * sizeof *x);
    /* C and gamma as the library's users start from; a grid search on a few scenes fits their quirks. */
    int rc = ggn_svm_train(&b->svm, x, c->label, c->n, b->features, 1.0, 1.0, err);
    free(x);
    return rc;
}

static int calibrate(struct ggn_baseline *b, const struct ggn_feature_set *t, const struct ggn_eval_set *s,
                     enum ggn_split split, struct base_err *err)
{
    struct cases c;
    enum ggn_split on = ggn_eval_count(s, GGN_SPLIT_VALIDATION) > 0 ? GGN_SPLIT_VALIDATION : split;
    int rc = list_cases(&c, b, t, s, on, err);
    if (rc)
        return rc;
    double *logit = malloc((c.n + 1) * sizeof *logit), *label = malloc((c.n + 1) * sizeof *label);
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(b, err);
    rc = !r ? err->code : !logit || !label ? base_fail_nomem(err, "baseline") : 0;
    int n = 0;
    for (size_t i = 0; i < c.n && !rc; i++) {
        const double *features[GGN_WINDOW_MAX];
        for (int k = 0; k < b->window; k++)
            features[k] = c.window[i] + (size_t)k * t->size;
        double l = ggn_baseline_logit(r, features, s->images.width, s->images.height);
        if (isfinite(l)) {
            logit[n] = l;
            label[n++] = c.label[i];
        }
    }
    if (!rc)
        ggn_calibrate_platt(logit, label, n, &b->policy);
    ggn_baseline_reader_destroy(r);
    free(label);
    free(logit);
    cases_release(&c);
    return rc;
}

/* The first window of the LSTM begins at the first level; an SVM answers from where that window ends. */
static void set_cadence(struct ggn_baseline *b, const struct ggn_eval_set *s)
{
    ggn_series_set_pace(&s->images, &b->policy);
    for (int k = b->window; k < s->window; k++)
        b->policy.first_spp = ggn_policy_next(&b->policy, b->policy.first_spp);
}

int ggn_baseline_train(struct ggn_baseline *b, const struct ggn_feature_set *t, const struct ggn_eval_set *s,
                       enum ggn_split split, int epochs, struct base_err *err)
{
    struct cases c;
    size_t positive = 0;
    int rc = list_cases(&c, b, t, s, split, err);
    if (rc)
        return rc;
    for (size_t i = 0; i < c.n; i++)
        positive += c.label[i];
    if (positive == 0 || positive == c.n)
        rc = base_fail(err, BASE_EINVAL, "%s: the split '%s' lacks one of the classes", ggn_baseline_titles[b->kind],
                       ggn_split_names[split]);
    if (!rc)
        rc = b->kind == GGN_SVD_ENTROPY ? train_lstm(b, &c, epochs, err) : train_svm(b, &c, t->size, err);
    cases_release(&c);
    set_cadence(b, s);
    return rc ? rc : calibrate(b, t, s, split, err);
}

/* --- judging --- */

struct one_block {
    const struct work *j;
    struct ggn_baseline_reader *reader;
    const double *first; /* features of its level 0 */
};

static double window_logit(void *data, const int *levels)
{
    const struct one_block *o = data;
    const double *features[GGN_WINDOW_MAX];
    for (int k = 0; k < o->j->baseline->window; k++)
        features[k] = o->first + (size_t)levels[k] * o->j->features->size;
    return ggn_baseline_logit(o->reader, features, o->j->set->images.width, o->j->set->images.height);
}

static int judge_block(void *data, long index, int worker, struct base_err *err)
{
    const struct work *j = data;
    const struct ggn_eval_block *b = &j->set->blocks[index];
    const struct ggn_level_series *c = &j->set->images.series[b->series];
    const struct ggn_stop_rule rule = {.policy = j->baseline->policy, .window = j->baseline->window};
    struct one_block one = {j, ggn_baseline_reader_create(j->baseline, err),
                            j->features->x + j->features->first[index] * j->features->size};
    struct ggn_seen *seen = malloc((size_t)c->n_levels * sizeof *seen);
    int rc = !one.reader ? err->code : !seen ? base_fail_nomem(err, j->method->name) : 0;
    (void)worker;
    if (!rc)
        ggn_replay(c, &rule, window_logit, &one, NULL, seen);
    for (size_t i = b->first; i < b->end && !rc; i++)
        j->method->score[i] = seen[i - b->first + (size_t)j->set->window - 1].p;
    free(seen);
    ggn_baseline_reader_destroy(one.reader);
    return rc;
}

int ggn_method_baseline(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_baseline *b,
                        const struct ggn_feature_set *features, struct base_threads *threads, struct base_err *err)
{
    struct work j = {s, b, features, m};
    int rc = ggn_method_init(m, s, ggn_baseline_titles[b->kind], 0, err);
    if (rc)
        return rc;
    m->cut = b->policy.threshold;
    m->passes = b->policy.passes;
    rc = ggn_each(threads, s->n_blocks, judge_block, &j, "evaluation", err);
    if (rc)
        ggn_method_release(m);
    return rc;
}

int ggn_method_learned(struct ggn_method *m, struct ggn_baseline *b, const struct ggn_eval_set *s,
                       enum ggn_baseline_kind kind, enum ggn_split split, double early, int epochs,
                       struct base_threads *threads, struct base_err *err)
{
    struct ggn_feature_set features = {0};
    *b = (struct ggn_baseline){0};
    int rc = ggn_baseline_init(b, kind, s->images.width, s->images.height, s->window, err), made = 0;
    if (!rc)
        rc = ggn_feature_set_make(&features, b, s, threads, err);
    if (!rc)
        rc = ggn_baseline_train(b, &features, s, split, epochs, err);
    if (!rc)
        made = !(rc = ggn_method_baseline(m, s, b, &features, threads, err));
    if (!rc && !(rc = ggn_method_tune(m, s, split, early, err)))
        b->policy.threshold = fmin(m->cut, 1);
    ggn_feature_set_release(&features);
    if (rc && made)
        ggn_method_release(m);
    if (rc)
        ggn_baseline_release(b);
    return rc;
}
