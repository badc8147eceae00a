/* Synthetic chains: levels that were never rendered, from one pair of half buffers and a reference. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "data/image.h"
#include "nn/weights.h"
#include "train/chains.h"

enum { MAX_LEVELS = 128 };
static const double HIGHEST_SHARE = 0.7; /* of the reference's samples: nearer than that nothing but the reference is left */
static const double JITTER = 0.04;       /* of the ratio between levels */

/* One block's source. */
struct source {
    float *base, *d; /* [3][P] linear: the converged image, the half-buffer difference */
    double n_full, n_reference;
};

static const struct ggn_seq_record *full_level(const struct ggn_seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (ggn_seq_has(&b->levels[i], GGN_PLANE_HALF_F16))
            return &b->levels[i];
    return NULL;
}

static int choose_levels(double *spp, double first, double ratio, double highest, uint32_t seed)
{
    int n = 0;

    for (double s = floor(first * (1 + 0.1 * ggn_hash_unit(0, seed)) + 0.5); n < MAX_LEVELS && s <= highest; n++) {
        spp[n] = s;
        s = fmax(s + 1, floor(s * ratio * (1 + JITTER * (2 * ggn_hash_unit((uint32_t)n + 1, seed) - 1)) + 0.5));
    }
    return n;
}

/* The running mean X_n of independent samples is, backwards, a walk: X_n − X_N has variance σ²·(1/n − 1/N), with independent
 * increments in 1/n. From the reference down to the noisiest level each step adds ±D·√(n_full·Δ(1/n)), the sign drawn per
 * pixel: D² estimates σ²/n_full there and keeps the colour of the noise. */
static void fill_levels(struct ggn_chain *c, const struct source *s, size_t pixels, float *noise, uint32_t seed)
{
    memset(noise, 0, 3 * pixels * sizeof *noise);
    for (int k = c->n_levels - 1; k >= 0; k--) {
        double above = k + 1 < c->n_levels ? 1 / c->spp[k + 1] : 1 / s->n_reference;
        float step = (float)sqrt(s->n_full * (1 / c->spp[k] - above));
        uint8_t *out = c->noisy + 3 * pixels * (size_t)k;
        uint32_t level_seed = ggn_hash((uint32_t)k, seed);
        for (size_t p = 0; p < pixels; p++) {
            float signed_step = ggn_hash((uint32_t)p, level_seed) & 1 ? step : -step;
            for (size_t i = p; i < 3 * pixels; i += pixels) {
                noise[i] += signed_step * s->d[i];
                out[i] = ggn_srgb_code((double)(s->base[i] + noise[i]));
            }
        }
    }
}

static int make_chain(struct ggn_chains *set, const struct ggn_chain *real, struct ggn_chain *c, const struct source *s,
                      uint32_t seed, struct ggn_err *err)
{
    size_t pixels = (size_t)set->width * (size_t)set->height;
    double spp[MAX_LEVELS];
    float *noise = malloc(3 * pixels * sizeof *noise);
    int n = choose_levels(spp, set->first_spp, set->ratio > 1.01 ? set->ratio : 1.15, HIGHEST_SHARE * s->n_reference, seed);

    *c = *real;
    c->synthetic = 1;
    c->tail999 = c->gini = NULL;
    c->denoised = NULL;
    c->n_levels = n;
    c->spp = malloc((size_t)(n ? n : 1) * sizeof *c->spp);
    c->noisy = malloc((size_t)(n ? n : 1) * 3 * pixels);
    if (!noise || !c->spp || !c->noisy) {
        free(noise);
        return ggn_fail_nomem(err, "synthetic images");
    }
    memcpy(c->spp, spp, (size_t)n * sizeof *spp);
    fill_levels(c, s, pixels, noise, seed);
    free(noise);
    return GGN_OK;
}

static int read_source(const struct ggn_chains *set, const struct ggn_chain *c, struct source *s, int *usable, struct ggn_err *err)
{
    const struct ggn_dataset_view *v = &set->data.views[c->view];
    struct ggn_seq_block b = {0};
    uint32_t index = 0;
    int rc = GGN_OK;

    *usable = 0;
    while (index < v->manifest.n_blocks && v->manifest.blocks[index].id != c->block)
        index++;
    if (index == v->manifest.n_blocks || !v->manifest.reference_spp || !v->manifest.reference_independent)
        return GGN_OK;
    rc = ggn_manifest_read_block(v->dir, &v->manifest, index, &b, err);
    if (rc)
        return rc;
    const struct ggn_seq_record *full = full_level(&b);
    if (full && b.reference) {
        s->n_full = full->spp;
        s->n_reference = b.reference->spp;
        rc = ggn_seq_mean(&b, b.reference, s->base, err);
        if (!rc)
            rc = ggn_seq_half(&b, full, s->d, err);
        *usable = !rc;
    }
    ggn_seq_block_release(&b);
    return rc;
}

int ggn_chains_add_synthetic(struct ggn_chains *set, int per_chain, uint32_t seed, struct ggn_err *err)
{
    size_t values = ggn_chains_values(set);
    struct source s = {.base = malloc(values * sizeof *s.base), .d = malloc(values * sizeof *s.d)};
    int rc = s.base && s.d ? GGN_OK : ggn_fail_nomem(err, "synthetic images"), real = set->n;

    for (int i = 0; !rc && i < real; i++) {
        int usable = 0;
        if (set->chains[i].split != GGN_SPLIT_TRAIN)
            continue;
        rc = read_source(set, &set->chains[i], &s, &usable, err);
        for (int k = 0; !rc && usable && k < per_chain; k++) {
            struct ggn_chain *c = ggn_chains_append(set, err);
            rc = c ? make_chain(set, &set->chains[i], c, &s, ggn_hash((uint32_t)(i * 64 + k), seed), err) : GGN_ENOMEM;
        }
    }
    free(s.base);
    free(s.d);
    return rc;
}
