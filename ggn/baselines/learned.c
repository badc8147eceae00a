#include "baselines/learned.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "baselines/features.h"
#include "baselines/lstm.h"
#include "baselines/svm.h"

/* Features of every level of every chain, [level][n]. */
struct table {
    int n;
    size_t *first; /* [blocks]: row of the block's level 0 */
    size_t rows;
    double *x; /* [rows][n] */
};

struct job {
    const struct ggn_eval_set *set;
    struct table *table;
    int (*make)(const double *l, int w, int h, int parameter, double *out, struct base_err *err);
    int parameter;
};

static void release_table(struct table *t)
{
    free(t->first);
    free(t->x);
}

static int make_attributes(const double *l, int w, int h, int parameter, double *out, struct base_err *err)
{
    (void)parameter;
    return ggn_attributes(l, w, h, out, err);
}

static int make_mask(const double *l, int w, int h, int parameter, double *out, struct base_err *err)
{
    (void)parameter;
    return ggn_noise_mask(l, w, h, out, err);
}

static int make_entropy(const double *l, int w, int h, int parameter, double *out, struct base_err *err)
{
    return ggn_svd_entropy(l, w, h, parameter, GGN_SUB_BLOCK, out, err);
}

static int fill_block(void *data, int index, int worker, struct base_err *err)
{
    const struct job *j = data;
    const struct ggn_eval_block *b = &j->set->blocks[index];
    const struct ggn_chain *c = &j->set->chains.chains[b->chain];
    int w = j->set->chains.width, h = j->set->chains.height, rc = 0;
    size_t pixels = (size_t)w * (size_t)h;
    double *l = malloc(pixels * sizeof *l);
    (void)worker;
    if (!l)
        return base_fail_nomem(err, "features");
    for (int i = 0; i < c->n_levels && !rc; i++) {
        ggn_lightness(c->noisy + 3 * pixels * (size_t)i, pixels, l);
        rc = j->make(l, w, h, j->parameter, j->table->x + (j->table->first[index] + (size_t)i) * (size_t)j->table->n, err);
    }
    free(l);
    return rc;
}

static int make_table(struct table *t, const struct ggn_eval_set *s, int n,
                      int (*make)(const double *, int, int, int, double *, struct base_err *), int parameter,
                      struct base_threads *threads, struct base_err *err)
{
    struct job j = {s, t, make, parameter};
    *t = (struct table){.n = n, .first = malloc((size_t)s->n_blocks * sizeof *t->first)};
    if (!t->first)
        return base_fail_nomem(err, "features");
    for (int b = 0; b < s->n_blocks; b++) {
        t->first[b] = t->rows;
        t->rows += (size_t)s->chains.chains[s->blocks[b].chain].n_levels;
    }
    t->x = malloc(t->rows * (size_t)n * sizeof *t->x);
    int rc = !t->x ? base_fail_nomem(err, "features") : ggn_eval_each_block(s, threads, fill_block, &j, err);
    if (rc)
        release_table(t);
    return rc;
}

/* Row of the table that a case is about: the last level of its window. */
static const double *row_of(const struct table *t, const struct ggn_eval_set *s, int b, size_t i)
{
    return t->x + (t->first[b] + (i - s->blocks[b].first) + (size_t)s->window - 1) * (size_t)t->n;
}

/* --- SVMs --- */

static struct ggn_svm *train_svm(const struct table *t, const struct ggn_eval_set *s, enum ggn_split split,
                                 struct base_err *err)
{
    double *x = malloc((s->n > 0 ? s->n : 1) * (size_t)t->n * sizeof *x);
    unsigned char *label = malloc(s->n > 0 ? s->n : 1);
    struct ggn_svm *svm = NULL;
    size_t n = 0;
    if (!x || !label) {
        base_fail_nomem(err, "SVM");
        goto out;
    }
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            if (s->blocks[b].split == split && s->noisy[i] >= 0) {
                memcpy(x + n * (size_t)t->n, row_of(t, s, b, i), (size_t)t->n * sizeof *x);
                label[n++] = s->noisy[i] == 1;
            }
    /* C and gamma as the library's users start from; a grid search on a few scenes fits their quirks. */
    svm = n > 0 ? ggn_svm_train(x, label, n, t->n, 1.0, 1.0, err) : NULL;
    if (n == 0)
        base_fail(err, BASE_EINVAL, "SVM: nothing to train on in the split '%s'", ggn_split_names[split]);
out:
    free(label);
    free(x);
    return svm;
}

static int svm_method(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, const char *name,
                      const struct table *t, struct base_err *err)
{
    struct ggn_svm *svm = train_svm(t, s, split, err);
    if (!svm)
        return err->code;
    double *score = malloc(s->n * sizeof *score), *scratch = malloc((size_t)t->n * sizeof *scratch);
    int rc = !score || !scratch ? base_fail_nomem(err, name) : 0;
    for (int b = 0; b < s->n_blocks && !rc; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            score[i] = ggn_svm_score(svm, row_of(t, s, b, i), scratch);
    if (!rc)
        rc = ggn_method_scores(m, s, name, score, err);
    free(scratch);
    free(score);
    ggn_svm_destroy(svm);
    return rc;
}

int ggn_method_attributes_svm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                              struct base_threads *threads, struct base_err *err)
{
    struct table t;
    int rc = make_table(&t, s, GGN_ATTRIBUTES, make_attributes, 0, threads, err);
    if (rc)
        return rc;
    rc = svm_method(m, s, split, "26 attributes + SVM", &t, err);
    release_table(&t);
    return rc;
}

int ggn_method_mask_svm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                        struct base_threads *threads, struct base_err *err)
{
    struct table t;
    int rc = make_table(&t, s, GGN_MASK_FEATURES, make_mask, 0, threads, err);
    if (rc)
        return rc;
    rc = svm_method(m, s, split, "noise mask + SVM", &t, err);
    release_table(&t);
    return rc;
}

/* --- SVD-entropy + LSTM --- */

/* The window of a case: its S levels, oldest first, [S][n]: rows of the table that follow one another. */
static const double *window_of(const struct table *t, const struct ggn_eval_set *s, int b, size_t i)
{
    return t->x + (t->first[b] + (i - s->blocks[b].first)) * (size_t)t->n;
}

static int train_lstm(struct ggn_lstm *lstm, const struct table *t, const struct ggn_eval_set *s, enum ggn_split split,
                      int epochs, struct base_err *err)
{
    const double **windows = malloc((s->n > 0 ? s->n : 1) * sizeof *windows);
    unsigned char *label = malloc(s->n > 0 ? s->n : 1);
    size_t n = 0, positive = 0;
    int rc = 0;
    if (!windows || !label) {
        rc = base_fail_nomem(err, "LSTM");
        goto out;
    }
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            if (s->blocks[b].split == split && s->noisy[i] >= 0) {
                windows[n] = window_of(t, s, b, i);
                label[n] = s->noisy[i] == 1;
                positive += label[n++];
            }
    if (positive == 0 || positive == n)
        rc = base_fail(err, BASE_EINVAL, "LSTM: the split '%s' lacks one of the classes", ggn_split_names[split]);
    for (int e = 0; e < epochs && !rc; e++)
        ggn_lstm_epoch(lstm, windows, label, n, (uint32_t)e);
out:
    free(label);
    free(windows);
    return rc;
}

int ggn_method_svd_lstm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, int first, int epochs,
                        struct base_threads *threads, struct base_err *err)
{
    struct table t;
    int count = ggn_svd_entropy_count(s->chains.width, s->chains.height), rc;
    if (count == 0)
        return base_fail(err, BASE_EINVAL, "SVD-entropy needs blocks of at least 20x20 pixels");
    rc = make_table(&t, s, count, make_entropy, first, threads, err);
    if (rc)
        return rc;
    struct ggn_lstm *lstm = ggn_lstm_create(count, s->window, 7, err);
    double *score = malloc(s->n * sizeof *score);
    rc = !lstm ? err->code : !score ? base_fail_nomem(err, "LSTM") : train_lstm(lstm, &t, s, split, epochs, err);
    for (int b = 0; b < s->n_blocks && !rc; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            score[i] = ggn_lstm_predict(lstm, window_of(&t, s, b, i));
    if (!rc)
        rc = ggn_method_scores(m, s, "SVD-entropy + LSTM", score, err);
    free(score);
    ggn_lstm_destroy(lstm);
    release_table(&t);
    return rc;
}
