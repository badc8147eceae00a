/* Levels that were never rendered, from one pair of half buffers and a reference: whole series, and the end of recorded
 * ones. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sight/preprocess.h"
#include "nn/hash.h"
#include "data/series.h"
#include "sequence/simulate.h"

enum { MAX_LEVELS = 512 };               /* 1.02 apart up to SEQ_SIMULATED_CAP they are fewer than 400 */
static const double HIGHEST_SHARE = 0.7; /* of the reference's samples: nearer than that nothing but the reference is left */
static const double JITTER = 0.04;       /* of the ratio between levels */
static const double CLEAN_END = 0.4;     /* a threshold below this share of the last level needs no further levels */

/* One block's source. */
struct source {
    float *base, *d, *last; /* [3][P] linear: the converged image, the half-buffer difference, the last recorded level */
    float *noise;           /* [3][P] of the level that is made; `base` owns all four */
    double n_full;          /* 0: the block is no source */
    double n_reference;     /* infinite: `base` is the mean of the full level and stands for the converged image */
};

/* Up to `highest` beyond `from`, each rounded to whole samples before it is multiplied. */
static int choose_levels(double *spp, double from, double first, double ratio, double highest, int jittered, uint32_t seed)
{
    int n = 0;
    for (double s = floor(first * (jittered ? 1 + 0.1 * ggn_hash_unit(0, seed) : 1) + 0.5);
         n < MAX_LEVELS && s - from <= highest; n++) {
        double off = jittered ? JITTER * (2 * ggn_hash_unit((uint32_t)n + 1, seed) - 1) : 0;
        spp[n] = s;
        s = fmax(s + 1, floor(s * ratio * (1 + off) + 0.5));
    }
    return n;
}

/* The running mean X_n of independent samples is, backwards, a walk: X_n − X_N has variance σ²·(1/n − 1/N), with independent
 * increments in 1/n. From the reference down to the fewest samples each step adds ±D·√(n_full·Δ(1/n)), the sign drawn per
 * pixel: D² estimates σ²/n_full there and keeps the colour of the noise. The noise takes one step from `above` to n samples.
 */
static void step_down(const struct source *s, size_t pixels, double n, double above, uint32_t seed)
{
    const float step = (float)sqrt(s->n_full * (1 / n - 1 / above)); /* seq_noise_scale, where above is infinite */
    for (size_t p = 0; p < pixels; p++) {
        float signed_step = ggn_hash((uint32_t)p, seed) & 1 ? step : -step;
        for (size_t i = p; i < 3 * pixels; i += pixels)
            s->noise[i] += signed_step * s->d[i];
    }
}

/* Level k of the series, whose mean is (a·(base + noise) + b·last)/(a + b), in display codes, and what is measured of it.
 * The measure's D is that of the full level, whose signs the noise has not kept: noise of its own, as of other samples, but
 * large in the same pixels. */
static void fill_level(const struct ggn_series_set *set, struct ggn_level_series *c, int k, const struct source *s, double a,
                       double b)
{
    const size_t values = ggn_series_set_values(set);
    uint8_t *out = c->noisy + values * (size_t)k;
    for (size_t v = 0; v < values; v++)
        out[v] = ggn_preprocess((b * (double)s->last[v] + a * (double)(s->base[v] + s->noise[v])) / (a + b), NULL, NULL);
    if (set->meter.memory)
        ggn_series_measure(set, c, k, s->base, s->d, seq_noise_scale(s->n_full, c->spp[k]), 1);
    else
        c->has_noise_map[k] = 0;
}

/* Gives the series these levels, in the place of all that it has beyond the first `kept`. X_n = (n₀·X + m·Y_m)/n with
 * m = n − n₀: the last level X that is kept, of n₀ samples, continued with m others, whose running mean Y_m is the walk. */
static int make_levels(const struct ggn_series_set *set, struct ggn_level_series *c, int kept, const struct source *s,
                       const double *spp, int n, uint32_t seed, struct base_err *err)
{
    const size_t values = ggn_series_set_values(set);
    const double n0 = kept ? c->spp[kept - 1] : 0;
    int rc = ggn_series_grow(set, c, kept + n > 0 ? kept + n : 1, err);
    if (rc)
        return rc;
    c->n_levels = kept + n;
    memcpy(c->spp + kept, spp, (size_t)n * sizeof *spp);
    /* The texture of all levels to be measured is that of the recorded halves, as in the labels (sight/curve.h): `base`
     * has noise of its own that the levels share. */
    if (set->meter.memory && n)
        ggn_series_measure(set, c, kept, s->base, s->d, 1, 0);
    memset(s->noise, 0, values * sizeof *s->noise);
    for (int k = n - 1; k >= 0; k--) {
        const double m = spp[k] - n0, above = k + 1 < n ? spp[k + 1] - n0 : s->n_reference;
        step_down(s, values / 3, m, above, ggn_hash((uint32_t)k, seed));
        fill_level(set, c, kept + k, s, kept ? m : 1, n0);
    }
    return 0;
}

/* Appends an empty series of the block of series `of`. */
static int append_copy(struct ggn_series_set *set, int of, struct base_err *err)
{
    int rc = ggn_series_set_append(set, err);
    if (rc)
        return rc;
    struct ggn_level_series *c = &set->series[set->n - 1];
    *c = set->series[of];
    c->synthetic = 1;
    c->n_levels = 0;
    c->spp = NULL;
    c->noisy = c->noise_map = c->has_noise_map = NULL;
    c->denoised = NULL;
    c->measure = NULL;
    return 0;
}

/* with_reference 0: as if none had been recorded. The caller frees s->base, also after a failure. */
static int read_source(const struct ggn_series_set *set, const struct ggn_level_series *c, int with_reference,
                       struct source *s, struct base_err *err)
{
    const struct ggn_dataset_view *v = &set->data.views[c->view];
    const size_t values = ggn_series_set_values(set);
    const uint32_t index = seq_manifest_find(&v->manifest, c->block);
    struct seq_block b;
    s->n_full = 0;
    if (index == v->manifest.n_blocks || !v->manifest.reference_independent)
        return 0;
    if (!s->base && !(s->base = malloc(4 * values * sizeof *s->base)))
        return base_fail_nomem(err, "synthetic images");
    s->d = s->base + values;
    s->last = s->d + values;
    s->noise = s->last + values;
    int rc = seq_manifest_read_block(v->dir, &v->manifest, index, &b, err);
    if (rc)
        return rc;
    const struct seq_record *full = seq_full_level(&b), *reference = with_reference ? b.reference : NULL;
    if (full) {
        s->n_full = full->spp;
        s->n_reference = reference ? reference->spp : (double)INFINITY;
        rc = seq_mean(&b, reference ? reference : full, s->base, err);
        if (!rc)
            rc = seq_half(&b, full, s->d, err);
        if (!rc)
            rc = seq_mean(&b, &b.levels[b.n_levels - 1], s->last, err);
    }
    seq_block_release(&b);
    return rc;
}

int ggn_series_set_add_synthetic(struct ggn_series_set *set, int per_series, uint32_t seed, struct base_err *err)
{
    const double ratio = set->ratio > 1.01 ? set->ratio : 1.15;
    struct source s = {0};
    double spp[MAX_LEVELS];
    int rc = 0;
    for (int i = 0, recorded = set->n; !rc && i < recorded; i++) {
        if (set->series[i].split != GGN_SPLIT_TRAIN)
            continue;
        rc = read_source(set, &set->series[i], 1, &s, err);
        for (int k = 0; !rc && s.n_full > 0 && isfinite(s.n_reference) && k < per_series; k++) {
            const uint32_t own_seed = ggn_hash((uint32_t)(i * 64 + k), seed);
            const int n = choose_levels(spp, 0, set->first_spp, ratio, HIGHEST_SHARE * s.n_reference, 1, own_seed);
            rc = append_copy(set, i, err);
            if (!rc)
                rc = make_levels(set, &set->series[set->n - 1], 0, &s, spp, n, own_seed, err);
        }
    }
    free(s.base);
    return rc;
}

/* Without a reference: levels up to SEQ_SIMULATED_CAP in place of the recorded ones. */
static int simulate_series(const struct ggn_series_set *set, struct ggn_level_series *c, const struct source *s,
                           double ratio, int jittered, uint32_t seed, struct base_err *err)
{
    double spp[MAX_LEVELS + 1];
    int n =
        choose_levels(spp, 0, set->first_spp < 16 ? set->first_spp : 16, ratio, SEQ_SIMULATED_CAP / ratio, jittered, seed);
    spp[n++] = SEQ_SIMULATED_CAP;
    int rc = make_levels(set, c, 0, s, spp, n, seed, err);
    c->simulated |= !rc;
    return rc;
}

int ggn_series_set_extend(struct ggn_series_set *set, int all, uint32_t seed, struct base_err *err)
{
    const double ratio = set->ratio > 1.01 ? set->ratio : 1.15;
    const double anew = set->ratio > 1.01 && set->ratio < 2 ? set->ratio : 1.2565; /* a third of an octave */
    struct source s = {0};
    double spp[MAX_LEVELS];
    int rc = 0;
    for (int i = 0, recorded = set->n; !rc && i < recorded; i++) {
        struct ggn_level_series *c = &set->series[i];
        const double last = c->n_levels ? c->spp[c->n_levels - 1] : 0;
        /* a clean end is recorded already, or nothing is known beyond it */
        const int done = c->label.threshold < CLEAN_END * last || (c->label.censored && c->label.threshold <= last);
        if (c->synthetic || !c->has_label || (done && !all))
            continue;
        rc = read_source(set, c, 1, &s, err);
        if (rc || !(s.n_full > 0))
            continue;
        const uint32_t own_seed = ggn_hash((uint32_t)i, seed + 1);
        if (isfinite(s.n_reference)) {
            const int n = choose_levels(spp, last, last * ratio, ratio, HIGHEST_SHARE * s.n_reference, 0, own_seed);
            rc = make_levels(set, c, c->n_levels, &s, spp, n, own_seed, err);
            continue;
        }
        if (set->keep_recorded)
            rc = append_copy(set, i, err);
        if (!rc)
            rc = simulate_series(set, &set->series[set->keep_recorded ? set->n - 1 : i], &s, anew, 1, own_seed, err);
    }
    free(s.base);
    return rc;
}

int ggn_series_set_simulate(struct ggn_series_set *set, double ratio, uint32_t seed, struct base_err *err)
{
    struct source s = {0};
    int rc = 0;
    for (int i = 0; !rc && i < set->n; i++) {
        struct ggn_level_series *c = &set->series[i];
        if (c->synthetic || !c->has_label)
            continue;
        rc = read_source(set, c, 0, &s, err);
        if (!rc && s.n_full > 0)
            rc = simulate_series(set, c, &s, ratio, 0, ggn_hash((uint32_t)i, seed + 1), err);
    }
    set->ratio = ratio;
    set->step_spp = 0;
    set->n_levels = 0;
    free(s.base);
    return rc;
}
