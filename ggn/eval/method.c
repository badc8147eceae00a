#include "eval/method.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "model/stopper.h"

void ggn_method_release(struct ggn_method *m)
{
    free(m->score);
    free(m->correction);
    free(m->stop);
    free(m->asked);
    *m = (struct ggn_method){0};
}

int ggn_eval_count(const struct ggn_eval_set *s, enum ggn_split split)
{
    int n = 0;
    for (int b = 0; b < s->n_blocks; b++)
        n += s->blocks[b].split == split;
    return n;
}

int ggn_method_init(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, int with_scores,
                    struct base_err *err)
{
    *m = (struct ggn_method){.passes = 1, .cut = (double)NAN};
    snprintf(m->name, sizeof m->name, "%s", name);
    m->stop = malloc((size_t)s->n_blocks * sizeof *m->stop);
    if (with_scores)
        m->score = malloc(s->n * sizeof *m->score);
    if (!m->stop || (with_scores && !m->score)) {
        ggn_method_release(m);
        return base_fail_nomem(err, name);
    }
    return 0;
}

int ggn_method_spp(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err)
{
    int rc = ggn_method_init(m, s, "-spp", 1, err);
    for (size_t i = 0; i < s->n && !rc; i++)
        m->score[i] = -s->spp[i];
    return rc;
}

int ggn_method_constant(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err)
{
    enum ggn_split split = ggn_eval_count(s, GGN_SPLIT_TRAIN) > 0 ? GGN_SPLIT_TRAIN : GGN_SPLIT_VALIDATION;
    size_t n = 0;
    double *t = malloc((size_t)s->n_blocks * sizeof *t);
    if (!t)
        return base_fail_nomem(err, "constant");
    int rc = ggn_method_init(m, s, "constant (training median)", 0, err);
    for (int b = 0; b < s->n_blocks; b++)
        if (s->blocks[b].split == split)
            t[n++] = s->blocks[b].label.threshold;
    double median = ggn_stats_quantile(t, n, 0.5);
    free(t);
    for (int b = 0; b < s->n_blocks && !rc; b++)
        m->stop[b] = isnan(median) ? s->blocks[b].cap : fmin(median, s->blocks[b].cap);
    return rc;
}

int ggn_method_scene_mean(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err)
{
    int rc = ggn_method_init(m, s, "scene's mean (oracle)", 0, err);
    for (int b = 0; b < s->n_blocks && !rc; b++) {
        double sum = 0.0, n = 0.0;
        for (int k = 0; k < s->n_blocks; k++)
            if (s->blocks[k].scene == s->blocks[b].scene) {
                sum += s->blocks[k].label.threshold;
                n += 1.0;
            }
        m->stop[b] = sum / n;
    }
    m->is_oracle = 1;
    return rc;
}

static int from_columns(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, const double *score,
                        const double *unsettled, int *available, struct base_err *err)
{
    int rc = ggn_method_init(m, s, name, 1, err);
    *available = 1;
    for (size_t i = 0; i < s->n && !rc; i++) {
        m->score[i] = score[i];
        *available &= !isnan(score[i]);
    }
    m->guard = unsettled; /* with the limit 0, the criteria's default, no pixel may be unsettled */
    return rc;
}

int ggn_method_halfbuf(struct ggn_method *m, const struct ggn_eval_set *s, int *available, struct base_err *err)
{
    int rc = from_columns(m, s, "halfbuf", s->dammertz, s->half_unsettled, available, err);
    for (int b = 0; b < s->n_blocks && !rc; b++) {
        const struct seq_manifest *v = &s->images.data.views[s->blocks[b].view].manifest;
        const struct seq_manifest_block *r = &v->blocks[s->blocks[b].index];
        /* the paper's r = sqrt(area of the block / area of the picture), which the criterion applies */
        double area = sqrt((double)(r->x1 - r->x0) * (r->y1 - r->y0) / ((double)v->width * v->height));
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            m->score[i] *= area;
    }
    return rc;
}

int ggn_method_variance(struct ggn_method *m, const struct ggn_eval_set *s, int *available, struct base_err *err)
{
    return from_columns(m, s, "variance", s->rse, s->rse_unsettled, available, err);
}

double ggn_method_verdict(const struct ggn_method *m, size_t i) { return m->score ? m->score[i] : (double)NAN; }

static int is_held(const struct ggn_method *m, size_t i, double limit) { return m->guard && m->guard[i] > limit; }

int ggn_method_passes(const struct ggn_method *m, size_t i)
{
    return ggn_method_verdict(m, i) < m->cut && !is_held(m, i, m->guard_limit);
}

static double stop_of(const struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_eval_block *b, double cut,
                      double limit)
{
    struct ggn_stopper row = {0};
    for (size_t i = b->first; i < b->end; i++)
        if (!isnan(m->score[i]) && ggn_stopper_pass(&row, m->passes, m->score[i] < cut) && !is_held(m, i, limit))
            return s->spp[i];
    return b->cap;
}

void ggn_method_run(struct ggn_method *m, const struct ggn_eval_set *s)
{
    for (int b = 0; b < s->n_blocks && m->score; b++)
        m->stop[b] = stop_of(m, s, &s->blocks[b], m->cut, m->guard_limit);
}

/* Early stops and samples of one cut on a split. */
static void cost_of(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double cut, double limit,
                    double *early, double *samples)
{
    double n = 0.0;
    *early = *samples = 0.0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split)
            continue;
        double stop = stop_of(m, s, block, cut, limit);
        n += 1.0;
        *samples += stop;
        *early += stop < 0.8 * block->label.threshold;
    }
    *early /= n;
}

int ggn_method_tune(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double early_rate,
                    struct base_err *err)
{
    enum { TRIES = 400 };
    size_t n = 0;
    double *scores = malloc((s->n > 0 ? s->n : 1) * sizeof *scores);
    if (!scores)
        return base_fail_nomem(err, m->name);
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            if (s->blocks[b].split == split && !isnan(m->score[i]))
                scores[n++] = m->score[i];
    if (n == 0) {
        free(scores);
        return base_fail(err, BASE_EINVAL, "%s: nothing to tune on in the split '%s'", m->name, ggn_split_names[split]);
    }
    ggn_stats_sort(scores, n);
    static const double limits[] = {0.0, 1e-4, 1e-3, 1e-2, INFINITY};
    double best_early = INFINITY, best_samples = INFINITY;
    for (int k = 0; k <= TRIES; k++)
        for (size_t g = m->guard ? 0 : 4; g < 5; g++) {
            double cut = k == TRIES ? nextafter(scores[n - 1], INFINITY) : scores[(size_t)k * n / TRIES], early, samples;
            cost_of(m, s, split, cut, limits[g], &early, &samples);
            int fits = early <= early_rate, fitted = best_early <= early_rate;
            if (fits != fitted ? fits
                               : (fits ? samples < best_samples
                                       : early < best_early || (early == best_early && samples < best_samples))) {
                best_early = early;
                best_samples = samples;
                m->cut = cut;
                m->guard_limit = limits[g];
            }
        }
    free(scores);
    ggn_method_run(m, s);
    return 0;
}

size_t ggn_method_stop_case(const struct ggn_method *m, const struct ggn_eval_set *s, int b)
{
    const struct ggn_eval_block *block = &s->blocks[b];
    for (size_t i = block->first; i < block->end; i++)
        if (s->spp[i] >= m->stop[b])
            return i;
    return block->end - 1;
}

/* --- figures --- */

static int score_figures(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                         struct ggn_method_metrics *out, struct base_err *err)
{
    double *score = malloc((s->n > 0 ? s->n : 1) * sizeof *score), sum = 0.0, cut;
    unsigned char *label = malloc(s->n > 0 ? s->n : 1);
    int rc = !score || !label ? base_fail_nomem(err, m->name) : 0, scenes = 0;
    size_t right = 0;
    for (int scene = -1; scene < s->n_scenes && !rc; scene++) { /* -1: all together */
        size_t n = 0;
        double auc;
        for (int b = 0; b < s->n_blocks; b++)
            for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
                if (s->blocks[b].split == split && (scene < 0 || s->blocks[b].scene == scene) && s->noisy[i] >= 0 &&
                    !isnan(m->score[i])) {
                    label[n] = (unsigned char)s->noisy[i];
                    score[n++] = m->score[i];
                }
        rc = ggn_stats_auc(score, label, n, &auc, err);
        if (scene < 0 && !rc) {
            out->cases = n;
            out->auc = auc;
            rc = ggn_stats_best_cut(score, label, n, &cut, &out->best_accuracy, err);
            for (size_t i = 0; i < n; i++)
                right += (score[i] >= m->cut) == (label[i] != 0);
            out->accuracy = n > 0 && !isnan(m->cut) ? (double)right / (double)n : (double)NAN;
        } else if (scene >= 0 && !isnan(auc)) {
            sum += auc;
            scenes++;
        }
    }
    out->auc_scene_mean = scenes > 0 ? sum / scenes : (double)NAN;
    free(label);
    free(score);
    return rc;
}

static int threshold_figures(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                             struct ggn_method_metrics *out, struct base_err *err)
{
    double *t = malloc(2 * (size_t)s->n_blocks * sizeof *t), early = 0.0, spent = 0.0, needed = 0.0;
    size_t n = 0;
    if (!t)
        return base_fail_nomem(err, m->name);
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split)
            continue;
        const double stop = ggn_eval_compared(block, m->stop[b]), needs = ggn_eval_compared(block, block->label.threshold);
        early += stop < 0.8 * needs;
        spent += stop;
        needed += needs;
        if (block->label.censored)
            continue;
        t[n] = needs;
        t[(size_t)s->n_blocks + n++] = stop;
    }
    out->early_stop_rate = early / out->blocks;
    out->samples_ratio = spent / needed;
    int rc = ggn_stats_agreement(t, t + s->n_blocks, n, INFINITY, &out->agreement, err);
    free(t);
    return rc;
}

/* Smallest number of samples everywhere at which no block of the split is worse than `worst`. */
static void uniform_figures(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                            struct ggn_method_metrics *out)
{
    double need = 0.0, spent = 0.0, time = 0.0, uniform = 0.0, uniform_time = 0.0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split)
            continue;
        size_t i = block->end - 1;
        while (i > block->first && s->flip[i - 1] <= out->flip_worst)
            i--;
        need = fmax(need, s->spp[i]);
    }
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split)
            continue;
        size_t i = block->first;
        while (i + 1 < block->end && s->spp[i] < need)
            i++;
        uniform += s->spp[i];
        uniform_time += s->seconds[i];
        spent += m->stop[b];
        time += s->seconds[ggn_method_stop_case(m, s, b)];
    }
    out->uniform_spp = need;
    out->samples_vs_uniform = spent / uniform;
    out->time_vs_uniform = time / uniform_time;
}

static void quality_figures(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                            struct ggn_method_metrics *out)
{
    double flip = 0.0, ssim = 0.0;
    out->flip_worst = -INFINITY;
    out->ssim_worst = INFINITY;
    for (int b = 0; b < s->n_blocks; b++) {
        if (s->blocks[b].split != split)
            continue;
        size_t i = ggn_method_stop_case(m, s, b);
        flip += s->flip[i];
        ssim += s->ssim[i];
        out->flip_worst = fmax(out->flip_worst, s->flip[i]);
        out->ssim_worst = fmin(out->ssim_worst, s->ssim[i]);
    }
    out->flip_mean = flip / out->blocks;
    out->ssim_mean = ssim / out->blocks;
    if (isnan(out->flip_mean))
        out->flip_worst = out->ssim_worst = (double)NAN;
    else
        uniform_figures(m, s, split, out);
}

int ggn_method_measure(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                       struct ggn_method_metrics *out, struct base_err *err)
{
    const double nan = (double)NAN;
    struct ggn_method_metrics r = {.auc = nan,
                                   .auc_scene_mean = nan,
                                   .accuracy = nan,
                                   .best_accuracy = nan,
                                   .uniform_spp = nan,
                                   .time_vs_uniform = nan,
                                   .samples_vs_uniform = nan};
    r.blocks = ggn_eval_count(s, split);
    if (r.blocks == 0)
        return base_fail(err, BASE_EINVAL, "no labelled block in the split '%s'", ggn_split_names[split]);
    for (int b = 0; b < s->n_blocks; b++)
        r.censored += s->blocks[b].split == split && s->blocks[b].label.censored;
    for (int scene = 0; scene < s->n_scenes; scene++) {
        int in = 0;
        for (int b = 0; b < s->n_blocks; b++)
            in |= s->blocks[b].split == split && s->blocks[b].scene == scene;
        r.scenes += in;
    }
    int rc = m->score ? score_figures(m, s, split, &r, err) : 0;
    if (!rc)
        rc = threshold_figures(m, s, split, &r, err);
    if (rc)
        return rc;
    quality_figures(m, s, split, &r);
    *out = r;
    return 0;
}
