#include "eval/set.h"

#include <math.h>
#include <stdlib.h>

#include "data/each.h"
#include "nn/ssim.h"
#include "sight/curve.h"
#include "sight/flip.h"
#include "sequence/simulate.h"
#include "sequence/tail.h"

void ggn_eval_set_release(struct ggn_eval_set *s)
{
    ggn_series_set_release(&s->images);
    free(s->blocks);
    free(s->spp); /* one allocation for all columns of doubles */
    free(s->noisy);
    *s = (struct ggn_eval_set){0};
}

/* Lists the labelled blocks and counts the cases. */
static int list_blocks(struct ggn_eval_set *s, int *skipped, struct base_err *err)
{
    const struct ggn_dataset *d = &s->images.data;
    s->blocks = malloc((size_t)(s->images.n > 0 ? s->images.n : 1) * sizeof *s->blocks);
    if (!s->blocks)
        return base_fail_nomem(err, "evaluation");
    *skipped = 0;
    for (int v = 0; v < d->n; v++)
        *skipped += !d->views[v].has_labels;
    for (int i = 0; i < s->images.n; i++) {
        const struct ggn_level_series *c = &s->images.series[i];
        const struct ggn_dataset_view *view = &d->views[c->view];
        if (!c->has_label)
            continue;
        if (c->n_levels < s->window)
            return base_fail(err, BASE_EINVAL, "%s: %d level%s, a window needs %d", view->dir, c->n_levels,
                             c->n_levels == 1 ? "" : "s", s->window);
        size_t cases = (size_t)(c->n_levels - s->window + 1);
        struct ggn_eval_block b = {.series = i,
                                   .view = c->view,
                                   .index = seq_manifest_find(&view->manifest, c->block),
                                   .split = view->split,
                                   .label = c->label,
                                   .cap = c->spp[c->n_levels - 1],
                                   .first = s->n,
                                   .end = s->n + cases};
        /* A threshold that no recorded level reached is only known to lie beyond the last one. */
        if (b.label.threshold >= b.cap) {
            b.label.threshold = b.cap;
            b.label.censored = 1;
        }
        s->blocks[s->n_blocks++] = b;
        s->n += cases;
    }
    if (s->n_blocks == 0)
        return base_fail(err, BASE_EINVAL, "no labelled block in the data (run ggn label first)");
    return 0;
}

enum { COLUMNS = 11 };

static int make_columns(struct ggn_eval_set *s, struct base_err *err)
{
    double **columns[COLUMNS] = {&s->spp,  &s->seconds, &s->dammertz, &s->half_unsettled, &s->rse,   &s->rse_unsettled,
                                 &s->flip, &s->ssim,    &s->visible,  &s->visible_means,  &s->relmse};
    double *all = malloc(COLUMNS * s->n * sizeof *all);
    s->noisy = malloc(s->n);
    s->spp = all;
    if (!all || !s->noisy)
        return base_fail_nomem(err, "evaluation");
    for (size_t c = 0; c < COLUMNS; c++) {
        *columns[c] = all + c * s->n;
        for (size_t i = 0; i < s->n; i++)
            all[c * s->n + i] = (double)NAN;
    }
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        const struct ggn_level_series *c = &s->images.series[block->series];
        for (size_t i = block->first; i < block->end; i++) {
            s->spp[i] = c->spp[i - block->first + (size_t)s->window - 1];
            s->noisy[i] = (signed char)ggn_label_noisy(&block->label, s->spp[i]);
        }
    }
    return 0;
}

int ggn_eval_count(const struct ggn_eval_set *s, enum ggn_split split)
{
    int n = 0;
    for (int b = 0; b < s->n_blocks; b++)
        n += s->blocks[b].split == split;
    return n;
}

struct fill {
    struct ggn_eval_set *set;
    int quality, no_ssim;
};

/* SSIM of two display images on [0,1], mean over the channels. */
static double ssim_of(struct ggn_ssim *ssim, const uint8_t *a, const uint8_t *b, size_t pixels, int width, float *work)
{
    const float *x[3], *y[3];
    for (size_t i = 0; i < 3 * pixels; i++) {
        work[i] = (float)a[i] / 255.0f;
        work[3 * pixels + i] = (float)b[i] / 255.0f;
    }
    for (size_t c = 0; c < 3; c++) {
        x[c] = work + c * pixels;
        y[c] = work + (3 + c) * pixels;
    }
    return ggn_ssim_mean(ssim, x, y, NULL, 3, width, 0.0);
}

static void interleave(const uint8_t *planar, size_t pixels, uint8_t *rgb)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = planar[c * pixels + i];
}

/* Against the reference, or what stands for it: without one simulated levels were made from the full level's mean. */
static int measure_quality(struct ggn_eval_set *s, const struct ggn_eval_block *block, int with_ssim, struct base_err *err)
{
    const struct ggn_level_series *c = &s->images.series[block->series];
    const int w = s->images.width, h = s->images.height;
    const size_t pixels = (size_t)w * (size_t)h, values = 3 * pixels;
    if (!c->reference)
        return 0;
    uint8_t *rgb = malloc(2 * values);
    float *work = malloc(2 * values * sizeof *work);
    struct ggn_ssim *ssim = ggn_ssim_create(h, w, NULL, err);
    int rc = rgb && work && ssim ? 0 : base_fail_nomem(err, "quality");
    if (!rc)
        interleave(c->reference, pixels, rgb);
    for (size_t i = block->first; i < block->end && !rc; i++) {
        const uint8_t *level = c->noisy + (i - block->first + (size_t)s->window - 1) * values;
        struct ggn_flip_stats flip;
        interleave(level, pixels, rgb + values);
        rc = ggn_flip(rgb, rgb + values, w, h, GGN_FLIP_PPD, NULL, &flip, err);
        s->flip[i] = flip.mean;
        if (with_ssim)
            s->ssim[i] = ssim_of(ssim, level, c->reference, pixels, w, work);
    }
    ggn_ssim_destroy(ssim);
    free(work);
    free(rgb);
    return rc;
}

/* Share of pixels that are unsettled at `scale` times the last recorded half-buffer difference. */
static double unsettled_share(const float *y, const float *d, size_t pixels, double scale)
{
    size_t n = 0;
    for (size_t i = 0; i < pixels; i++)
        n += (size_t)seq_is_unsettled(scale * fabs((double)d[i]), (double)y[i]);
    return (double)n / (double)pixels;
}

/* The criteria's figures beyond the recording, from its last level. */
static int extrapolate(struct ggn_eval_set *s, const struct ggn_eval_block *block, size_t from, const struct seq_block *p,
                       struct base_err *err)
{
    const struct seq_record *last = &p->levels[p->n_levels - 1];
    size_t pixels = (size_t)p->width * p->height;
    double half = seq_stat(last, "half_unsettled");
    float *planes = malloc(2 * pixels * sizeof *planes);
    int rc = !planes ? base_fail_nomem(err, "evaluation") : seq_mean_luminance(p, last, planes, err);
    if (!rc)
        rc = seq_half_luminance(p, last, planes + pixels, err);
    for (size_t i = from; i < block->end && !rc; i++) {
        double scale = seq_noise_scale(last->spp, s->spp[i]);
        s->seconds[i] = seq_stat(last, "seconds") * s->spp[i] / last->spp;
        s->dammertz[i] = scale * seq_stat(last, "dammertz");
        s->rse[i] = scale * seq_stat(last, "rse");
        s->half_unsettled[i] = unsettled_share(planes, planes + pixels, pixels, scale);
        s->rse_unsettled[i] = half > 0.0 ? seq_stat(last, "rse_unsettled") * s->half_unsettled[i] / half : 0.0;
    }
    free(planes);
    return rc;
}

/* The recorded level that a host without halves would compare level k with: the last of at most half its samples; NULL:
 * none. */
static const struct seq_record *earlier_look(const struct seq_block *p, uint32_t k)
{
    uint32_t from = k;
    while (from > 0 && 2 * p->levels[from].spp > p->levels[k].spp)
        from--;
    return 2 * p->levels[from].spp <= p->levels[k].spp ? &p->levels[from] : NULL;
}

/* Of each recorded level what the observer sees from its own halves, and how many times that without them; NaN: unknown. */
static int see_levels(const struct seq_block *p, double *halves, double *ratio, struct base_err *err)
{
    int rc = 0;
    for (uint32_t k = 0; k < p->n_levels && !rc; k++) {
        const struct seq_record *r = &p->levels[k], *earlier = earlier_look(p, k);
        double means;
        halves[k] = ratio[k] = (double)NAN;
        if (!seq_has_halves(r))
            continue;
        rc = ggn_curve_level(p, NULL, r, &halves[k], err);
        if (rc || !earlier)
            continue;
        rc = ggn_curve_level(p, earlier, r, &means, err);
        if (!rc)
            ratio[k] = halves[k] > 0.0 ? means / halves[k] : 1.0;
    }
    return rc;
}

/* With halves: at recorded levels from their own, at all others from the two of the full level. Without: in the same ratio
 * to that as at the nearest recorded level that knows it, at or below, or else at the first. */
static void fill_visible(struct ggn_eval_set *s, const struct ggn_eval_block *block, const struct seq_block *p,
                         const double *halves, const double *ratio, const struct ggn_curve *curve)
{
    const int simulated = s->images.series[block->series].simulated;
    uint32_t k = 0;
    double now = (double)NAN;
    while (k < p->n_levels && isnan(now))
        now = ratio[k++];
    for (size_t i = block->first; i < block->end; i++) {
        const struct seq_record *r = simulated ? NULL : seq_level(p, (uint32_t)s->spp[i]);
        if (r && seq_has_halves(r))
            s->visible[i] = halves[r - p->levels];
        else if (!r && curve->n > 0)
            s->visible[i] = ggn_curve_at(curve, s->spp[i]);
        for (; k < p->n_levels && p->levels[k].spp <= s->spp[i]; k++)
            now = isnan(ratio[k]) ? now : ratio[k];
        s->visible_means[i] = now * s->visible[i];
    }
}

static int fill_observed(struct ggn_eval_set *s, const struct ggn_eval_block *block, const struct seq_block *p,
                         struct base_err *err)
{
    struct ggn_curve curve = {0};
    double *halves = malloc(2 * p->n_levels * sizeof *halves), *ratio = halves ? halves + p->n_levels : NULL;
    int rc = halves ? see_levels(p, halves, ratio, err) : base_fail_nomem(err, "evaluation");
    if (!rc && seq_full_level(p))
        rc = ggn_curve_make(p, GGN_FROM_HALVES, 1, &curve, err);
    if (!rc)
        fill_visible(s, block, p, halves, ratio, &curve);
    ggn_curve_release(&curve);
    free(halves);
    return rc;
}

/* Mean over pixels and channels of D^2/(M^2 + 0.01), M and D of the full level: its variance, which falls with the samples.
 */
static int fill_relmse(struct ggn_eval_set *s, const struct ggn_eval_block *block, const struct seq_block *p,
                       struct base_err *err)
{
    const struct seq_record *full = seq_full_level(p);
    size_t values = 3 * (size_t)p->width * p->height;
    if (!full)
        return 0;
    float *mean = malloc(2 * values * sizeof *mean), *d = mean ? mean + values : NULL;
    int rc = mean ? seq_halves(p, full, mean, d, err) : base_fail_nomem(err, "evaluation");
    double sum = 0.0;
    for (size_t i = 0; i < values && !rc; i++)
        sum += (double)(d[i] * d[i]) / ((double)(mean[i] * mean[i]) + 0.01);
    for (size_t i = block->first; i < block->end && !rc; i++)
        s->relmse[i] = sum / (double)values * full->spp / s->spp[i];
    free(mean);
    return rc;
}

static int fill_statistics(struct ggn_eval_set *s, const struct ggn_eval_block *block, struct base_err *err)
{
    const struct ggn_dataset_view *v = &s->images.data.views[block->view];
    struct seq_block p;
    size_t i = block->first;
    int rc = seq_manifest_read_block(v->dir, &v->manifest, block->index, &p, err);
    if (rc)
        return rc;
    for (const struct seq_record *r; i < block->end && (r = seq_level(&p, (uint32_t)s->spp[i])); i++) {
        s->seconds[i] = seq_stat(r, "seconds");
        s->dammertz[i] = seq_stat(r, "dammertz");
        s->half_unsettled[i] = seq_stat(r, "half_unsettled");
        s->rse[i] = seq_stat(r, "rse");
        s->rse_unsettled[i] = seq_stat(r, "rse_unsettled");
    }
    const struct seq_record *last = &p.levels[p.n_levels - 1];
    if (i < block->end && seq_has_halves(last))
        rc = extrapolate(s, block, i, &p, err);
    if (!rc)
        rc = fill_observed(s, block, &p, err);
    if (!rc)
        rc = fill_relmse(s, block, &p, err);
    seq_block_release(&p);
    return rc;
}

static int fill_block(void *data, long index, int worker, struct base_err *err)
{
    struct fill *f = data;
    const struct ggn_eval_block *block = &f->set->blocks[index];
    (void)worker;
    int rc = fill_statistics(f->set, block, err);
    return !rc && f->quality ? measure_quality(f->set, block, !f->no_ssim, err) : rc;
}

/* Continues every labelled series: a method that does not stop in time must be seen to. */
static int extend(struct ggn_series_set *set, double cadence, uint32_t seed, struct base_err *err)
{
    int rc = cadence > 1.0 ? ggn_series_set_simulate(set, cadence, seed, err) : ggn_series_set_extend(set, 1, seed, err);
    for (int i = 0; i < set->n; i++) {
        struct ggn_level_series *c = &set->series[i];
        /* A threshold that is only known to lie beyond the recording stays there. */
        while (c->label.censored && c->n_levels > 1 && c->spp[c->n_levels - 1] > c->label.threshold)
            c->n_levels--;
    }
    return rc;
}

int ggn_eval_set_load(struct ggn_eval_set *out, const struct ggn_eval_options *o, struct base_threads *threads, int *skipped,
                      struct base_err *err)
{
    struct ggn_eval_set s = {.window = o->window};
    struct ggn_series_set_options data = o->data;
    struct fill f = {&s, o->quality, o->no_ssim};
    data.with_test = 1;
    int rc = ggn_series_set_load(&s.images, &data, err);
    if (rc)
        return rc;
    if (!o->recorded)
        rc = extend(&s.images, o->cadence, o->seed, err);
    if (!rc)
        rc = list_blocks(&s, skipped, err);
    if (!rc)
        rc = make_columns(&s, err);
    if (!rc)
        rc = ggn_each(threads, s.n_blocks, fill_block, &f, "evaluation", err);
    s.law = o->without_halves ? s.visible_means : s.visible;
    if (rc)
        ggn_eval_set_release(&s);
    else
        *out = s;
    return rc;
}
