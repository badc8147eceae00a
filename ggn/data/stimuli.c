#include "data/stimuli.h"

#include <stdlib.h>

#include "model/preprocess.h"
#include "sequence/simulate.h"

enum { MAX_SIMULATED = 64 };

void ggn_stimuli_release(struct ggn_stimuli *s)
{
    free(s->spp);
    free(s->base);
    free(s->converged);
    *s = (struct ggn_stimuli){0};
}

static void encode(const float *linear, size_t pixels, uint8_t *rgb)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = ggn_preprocess((double)linear[c * pixels + i], NULL, NULL);
}

/* Sample counts above `beyond` that halves stand for; returns their number. */
static int simulated_levels(double beyond, double spp[MAX_SIMULATED])
{
    uint32_t all[MAX_SIMULATED];
    int n = 0;
    for (int i = 0, count = seq_levels(20, SEQ_STUDY_CAP, 1.15, 1, all, MAX_SIMULATED); i < count; i++)
        if (all[i] > beyond)
            spp[n++] = all[i];
    return n;
}

/* Whether halves stand for levels beyond the last recorded one; up to a tenth of an octave is not worth simulating. */
static int extends(const struct seq_block *b, int reference_independent)
{
    return reference_independent && b->reference && seq_full_level(b) &&
           1.07 * b->levels[b->n_levels - 1].spp < SEQ_STUDY_CAP && seq_has(b->reference, SEQ_PLANE_MEAN_F16);
}

/* Without a reference: the mean of the full level stands for the converged image. */
static int init_halves(struct ggn_stimuli *s, struct base_err *err)
{
    const struct seq_block *b = s->block;
    const struct seq_record *full = seq_full_level(b);
    if (!full)
        return base_fail(err, BASE_EINVAL, "block %u has neither a reference nor a full level with a half-buffer difference",
                         b->id);
    s->spp0 = full->spp;
    int rc = seq_halves(b, full, s->base, s->difference, err);
    if (!rc)
        encode(s->base, (size_t)b->width * b->height, s->converged);
    return rc;
}

static int init_recorded(struct ggn_stimuli *s, int reference_independent, int extend, struct base_err *err)
{
    const struct seq_block *b = s->block;
    s->scale = reference_independent && seq_has(b->reference, SEQ_PLANE_MEAN_F16);
    int rc = s->scale ? seq_mean(b, b->reference, s->base, err) : 0;
    if (!rc && extend) {
        s->spp0 = seq_full_level(b)->spp;
        rc = seq_half(b, seq_full_level(b), s->difference, err);
    }
    return !rc ? seq_display(b, b->reference, s->converged, err) : rc;
}

int ggn_stimuli_init(struct ggn_stimuli *out, const struct seq_block *block, int reference_independent, struct base_err *err)
{
    size_t pixels = (size_t)block->width * block->height;
    struct ggn_stimuli s = {.block = block, .recorded = block->reference ? (int)block->n_levels : 0};
    int extend = extends(block, reference_independent);
    double beyond = s.recorded > 0 ? 1.07 * block->levels[s.recorded - 1].spp : 0.0, simulated[MAX_SIMULATED];
    s.n = s.recorded + (extend || s.recorded == 0 ? simulated_levels(beyond, simulated) : 0);
    s.spp = malloc((size_t)s.n * sizeof *s.spp);
    s.base = malloc(9 * pixels * sizeof *s.base);
    s.converged = malloc(3 * pixels);
    s.difference = s.base ? s.base + 3 * pixels : NULL;
    s.work = s.base ? s.base + 6 * pixels : NULL;
    int rc = 0;
    if (!s.spp || !s.base || !s.converged)
        rc = base_fail_nomem(err, "observer");
    else if (!block->reference)
        rc = init_halves(&s, err);
    else
        rc = init_recorded(&s, reference_independent, extend, err);
    if (rc) {
        ggn_stimuli_release(&s);
        return rc;
    }
    for (int i = 0; i < s.recorded; i++)
        s.spp[i] = block->levels[i].spp;
    for (int i = s.recorded; i < s.n; i++)
        s.spp[i] = simulated[i - s.recorded];
    *out = s;
    return 0;
}

int ggn_stimuli_make(struct ggn_stimuli *s, int level, uint8_t *test, struct base_err *err)
{
    const struct seq_block *b = s->block;
    size_t pixels = (size_t)b->width * b->height;
    if (level >= s->recorded) {
        seq_simulate(s->base, s->difference, 3 * pixels, seq_noise_scale(s->spp0, s->spp[level]), s->work);
        encode(s->work, pixels, test);
        return 0;
    }
    const struct seq_record *r = &b->levels[level];
    if (!s->scale || !(seq_has(r, SEQ_PLANE_MEAN_F16) || seq_has(r, SEQ_PLANE_FINE)))
        return seq_display(b, r, test, err);
    int rc = seq_mean(b, r, s->work, err);
    if (rc)
        return rc;
    for (size_t i = 0; i < 3 * pixels; i++)
        s->work[i] -= s->base[i];
    seq_simulate(s->base, s->work, 3 * pixels, seq_reference_scale(b->reference->spp, r->spp), s->work);
    encode(s->work, pixels, test);
    return 0;
}
