#include "eval/method.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "sight/stats.h"
#include "model/stopper.h"

void ggn_method_release(struct ggn_method *m)
{
    free(m->score);
    free(m->correction);
    *m = (struct ggn_method){0};
}

int ggn_method_init(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, int with_correction,
                    struct base_err *err)
{
    *m = (struct ggn_method){.passes = 1,
                             .cut = (double)NAN,
                             .score = malloc(s->n * sizeof *m->score),
                             .correction = with_correction ? calloc(s->n, sizeof *m->correction) : NULL};
    snprintf(m->name, sizeof m->name, "%s", name);
    if (m->score && (m->correction || !with_correction))
        return 0;
    ggn_method_release(m);
    return base_fail_nomem(err, name);
}

static double stop_of(const struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_eval_block *b, double cut)
{
    struct ggn_stopper row = {0};
    for (size_t i = b->first; i < b->end; i++)
        if (!isnan(m->score[i]) && ggn_stopper_pass(&row, m->passes, m->score[i] < cut))
            return s->spp[i];
    return b->cap;
}

/* Early stops, and samples against those of the thresholds, of one cut on a split. */
static void cost_of(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double cut,
                    double *early, double *samples)
{
    double n = 0.0, needed = 0.0;
    *early = *samples = 0.0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split)
            continue;
        double stop = stop_of(m, s, block, cut);
        n += 1.0;
        *samples += stop;
        needed += block->label.threshold;
        *early += stop < 0.8 * block->label.threshold;
    }
    *early /= n;
    *samples /= needed;
}

/* The scores of a split, and (label not NULL) whether noise is seen, of the cases where both are known. */
static size_t scores_of(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double *score,
                        unsigned char *label)
{
    size_t n = 0;
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++) {
            if (s->blocks[b].split != split || isnan(m->score[i]) || (label && s->noisy[i] < 0))
                continue;
            if (label)
                label[n] = (unsigned char)s->noisy[i];
            score[n++] = m->score[i];
        }
    return n;
}

int ggn_method_tune(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double early_rate,
                    struct base_err *err)
{
    enum { TRIES = 400 };
    double *scores = malloc((s->n > 0 ? s->n : 1) * sizeof *scores);
    if (!scores)
        return base_fail_nomem(err, m->name);
    const size_t n = scores_of(m, s, split, scores, NULL);
    if (n == 0) {
        free(scores);
        return base_fail(err, BASE_EINVAL, "%s: nothing to tune on in the split '%s'", m->name, ggn_split_names[split]);
    }
    ggn_stats_sort(scores, n);
    double best_early = INFINITY, best_samples = INFINITY;
    for (int k = 0; k <= TRIES; k++) {
        double cut = k == TRIES ? nextafter(scores[n - 1], INFINITY) : scores[(size_t)k * n / TRIES], early, samples;
        cost_of(m, s, split, cut, &early, &samples);
        int fits = early <= early_rate, fitted = best_early <= early_rate;
        int cheaper = samples < best_samples;
        if (fits != fitted ? fits : fits ? cheaper : early < best_early || (early == best_early && cheaper)) {
            best_early = early;
            best_samples = samples;
            m->cut = cut;
        }
    }
    free(scores);
    return 0;
}

/* Whether the split has a block of the scene. */
static int has_scene(const struct ggn_eval_set *s, enum ggn_split split, int scene)
{
    for (int b = 0; b < s->n_blocks; b++)
        if (s->blocks[b].split == split && s->images.data.views[s->blocks[b].view].scene == scene)
            return 1;
    return 0;
}

int ggn_method_measure(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                       struct ggn_method_figures *out, struct base_err *err)
{
    double *score = malloc((s->n > 0 ? s->n : 1) * sizeof *score);
    unsigned char *label = malloc(s->n > 0 ? s->n : 1);
    int rc = !score || !label ? base_fail_nomem(err, m->name) : 0;
    *out = (struct ggn_method_figures){.blocks = ggn_eval_count(s, split)};
    for (int scene = 0; scene < s->images.data.n_scenes; scene++)
        out->scenes += has_scene(s, split, scene);
    if (!rc) {
        out->windows = scores_of(m, s, split, score, label);
        rc = ggn_stats_auc(score, label, out->windows, &out->auc, err);
        cost_of(m, s, split, m->cut, &out->early_stop_rate, &out->samples_ratio);
    }
    free(label);
    free(score);
    return rc;
}
