#include "baselines/learned.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "baselines/lstm.h"
#include "data/each.h"
#include "data/replay.h"
#include "train/fit_policy.h"

/* A baseline at work on the blocks of a set, and its features of all their levels. */
struct work {
    const struct ggn_eval_set *set;
    struct ggn_baseline *baseline;
    struct ggn_method *method; /* gets the scores */
    size_t size;               /* numbers per level */
    double *x;                 /* owns; [rows][size]; a row for every level of every block, one block after the other */
};

/* The row of a block's level 0; beyond the last block, how many rows there are. A block's first levels make no case. */
static size_t first_row(const struct ggn_eval_set *s, int block)
{
    const size_t cases = block < s->n_blocks ? s->blocks[block].first : s->n;
    return cases + (size_t)block * (size_t)(s->window - 1);
}

static int extract_block(void *data, long index, int worker, struct base_err *err)
{
    const struct work *w = data;
    const struct ggn_series_set *images = &w->set->images;
    const struct ggn_level_series *c = &images->series[w->set->blocks[index].series];
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(w->baseline, err);
    (void)worker;
    if (!r)
        return err->code;
    for (size_t i = 0; i < (size_t)c->n_levels; i++)
        ggn_baseline_extract(r, c->noisy + ggn_series_set_values(images) * i, images->width, images->height,
                             w->x + (first_row(w->set, (int)index) + i) * w->size);
    ggn_baseline_reader_destroy(r);
    return 0;
}

/* Fills in the features of w->baseline; the caller frees them, also after a failure. */
static int extract(struct work *w, struct base_threads *threads, struct base_err *err)
{
    const struct ggn_eval_set *s = w->set;
    w->size = ggn_baseline_feature_count(w->baseline, s->images.width, s->images.height);
    w->x = malloc(first_row(s, s->n_blocks) * w->size * sizeof *w->x);
    return w->x ? ggn_each(threads, s->n_blocks, extract_block, w, "evaluation", err) : base_fail_nomem(err, "baseline");
}

/* Of a window whose levels, or (NULL) rows one after the other, begin at x. */
static double logit_of(const struct work *w, struct ggn_baseline_reader *r, const double *x, const int *levels)
{
    const double *features[GGN_WINDOW_MAX];
    for (int k = 0; k < w->baseline->window; k++)
        features[k] = x + (size_t)(levels ? levels[k] : k) * w->size;
    return ggn_baseline_logit(r, features, w->set->images.width, w->set->images.height);
}

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

static int list_cases(struct cases *c, const struct work *w, enum ggn_split split, struct base_err *err)
{
    const struct ggn_eval_set *s = w->set;
    size_t room = s->n > 0 ? s->n : 1, skipped = (size_t)(s->window - w->baseline->window);
    *c = (struct cases){.window = malloc(room * sizeof *c->window), .label = malloc(room)};
    if (!c->window || !c->label) {
        cases_release(c);
        return base_fail_nomem(err, "baseline");
    }
    for (int k = 0; k < s->n_blocks; k++)
        for (size_t i = s->blocks[k].first; i < s->blocks[k].end; i++)
            if (s->blocks[k].split == split && s->noisy[i] >= 0) {
                c->window[c->n] = w->x + (first_row(s, k) + (i - s->blocks[k].first) + skipped) * w->size;
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

static int calibrate(const struct work *w, enum ggn_split split, struct base_err *err)
{
    struct cases c;
    enum ggn_split on = ggn_eval_count(w->set, GGN_SPLIT_VALIDATION) > 0 ? GGN_SPLIT_VALIDATION : split;
    int rc = list_cases(&c, w, on, err);
    if (rc)
        return rc;
    double *logit = malloc((c.n + 1) * sizeof *logit), *label = malloc((c.n + 1) * sizeof *label);
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(w->baseline, err);
    rc = !r ? err->code : !logit || !label ? base_fail_nomem(err, "baseline") : 0;
    int n = 0;
    for (size_t i = 0; i < c.n && !rc; i++) {
        logit[n] = logit_of(w, r, c.window[i], NULL);
        label[n] = c.label[i];
        n += isfinite(logit[n]) != 0;
    }
    if (!rc)
        ggn_calibrate_platt(logit, label, n, &w->baseline->policy);
    ggn_baseline_reader_destroy(r);
    free(label);
    free(logit);
    cases_release(&c);
    return rc;
}

/* All but the threshold, which stays at 0.5. */
static int train(const struct work *w, enum ggn_split split, int epochs, struct base_err *err)
{
    struct ggn_baseline *b = w->baseline;
    struct cases c;
    size_t positive = 0;
    int rc = list_cases(&c, w, split, err);
    if (rc)
        return rc;
    for (size_t i = 0; i < c.n; i++)
        positive += c.label[i];
    if (positive == 0 || positive == c.n)
        rc = base_fail(err, BASE_EINVAL, "%s: the split '%s' lacks one of the classes", ggn_baseline_titles[b->kind],
                       ggn_split_names[split]);
    else if (b->kind == GGN_SVD_ENTROPY)
        rc = train_lstm(b, &c, epochs, err);
    else /* C and gamma as the library's users start from; a grid search on a few scenes fits their quirks */
        rc = ggn_svm_train(&b->svm, c.window, c.label, c.n, b->features, 1.0, 1.0, err);
    cases_release(&c);
    ggn_series_set_pace(&w->set->images, &b->policy);
    for (int k = b->window; k < w->set->window; k++) /* an SVM answers from where the LSTM's first window ends */
        b->policy.first_spp = ggn_policy_next(&b->policy, b->policy.first_spp);
    return rc ? rc : calibrate(w, split, err);
}

struct one_block {
    const struct work *work;
    struct ggn_baseline_reader *reader;
    const double *first; /* features of its level 0 */
};

static double window_logit(void *data, const int *levels)
{
    const struct one_block *o = data;
    return logit_of(o->work, o->reader, o->first, levels);
}

static int judge_block(void *data, long index, int worker, struct base_err *err)
{
    const struct work *w = data;
    const struct ggn_eval_block *b = &w->set->blocks[index];
    const struct ggn_level_series *c = &w->set->images.series[b->series];
    const struct ggn_stop_rule rule = {.policy = w->baseline->policy, .window = w->baseline->window};
    struct one_block one = {w, ggn_baseline_reader_create(w->baseline, err), w->x + first_row(w->set, (int)index) * w->size};
    struct ggn_seen *seen = malloc((size_t)c->n_levels * sizeof *seen);
    int rc = !one.reader ? err->code : !seen ? base_fail_nomem(err, w->method->name) : 0;
    (void)worker;
    if (!rc)
        ggn_replay(c, &rule, window_logit, &one, NULL, seen);
    for (size_t i = b->first; i < b->end && !rc; i++)
        w->method->score[i] = seen[i - b->first + (size_t)w->set->window - 1].p;
    free(seen);
    ggn_baseline_reader_destroy(one.reader);
    return rc;
}

/* On failure *w->method is empty. */
static int judge(struct work *w, struct base_threads *threads, struct base_err *err)
{
    int rc = ggn_method_init(w->method, w->set, ggn_baseline_titles[w->baseline->kind], 0, err);
    if (rc)
        return rc;
    w->method->cut = w->baseline->policy.threshold;
    w->method->passes = w->baseline->policy.passes;
    rc = ggn_each(threads, w->set->n_blocks, judge_block, w, "evaluation", err);
    if (rc)
        ggn_method_release(w->method);
    return rc;
}

int ggn_method_baseline(struct ggn_method *m, const struct ggn_eval_set *s, struct ggn_baseline *b,
                        struct base_threads *threads, struct base_err *err)
{
    struct work w = {.set = s, .baseline = b, .method = m};
    int rc = extract(&w, threads, err);
    if (!rc)
        rc = judge(&w, threads, err);
    free(w.x);
    return rc;
}

int ggn_method_learned(struct ggn_method *m, struct ggn_baseline *b, const struct ggn_eval_set *s,
                       enum ggn_baseline_kind kind, enum ggn_split split, double early, int epochs,
                       struct base_threads *threads, struct base_err *err)
{
    struct work w = {.set = s, .baseline = b, .method = m};
    *m = (struct ggn_method){0};
    *b = (struct ggn_baseline){0};
    int rc = ggn_baseline_init(b, kind, s->images.width, s->images.height, s->window, err);
    if (!rc)
        rc = extract(&w, threads, err);
    if (!rc)
        rc = train(&w, split, epochs, err);
    if (!rc)
        rc = judge(&w, threads, err);
    if (!rc)
        rc = ggn_method_tune(m, s, split, early, err);
    if (!rc)
        b->policy.threshold = fmin(m->cut, 1);
    free(w.x);
    if (rc) {
        ggn_method_release(m);
        ggn_baseline_release(b);
    }
    return rc;
}
