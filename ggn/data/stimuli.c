#include "data/stimuli.h"

#include <stdlib.h>

#include "sight/preprocess.h"
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

int ggn_stimuli_init(struct ggn_stimuli *out, const struct seq_block *block, int reference_independent, struct base_err *err)
{
    const struct seq_record *full = seq_full_level(block), *reference = block->reference;
    const size_t pixels = (size_t)block->width * block->height;
    struct ggn_stimuli s = {.block = block, .recorded = reference ? (int)block->n_levels : 0};
    const double beyond = s.recorded > 0 ? 1.07 * block->levels[s.recorded - 1].spp : 0.0;
    s.scale = reference && reference_independent && seq_has(reference, SEQ_PLANE_MEAN_F16);
    /* Halves stand for levels beyond the last recorded one; up to a tenth of an octave is not worth simulating. */
    const int extend = s.scale && full && beyond < SEQ_STUDY_CAP;
    if (!reference && !full)
        return base_fail(err, BASE_EINVAL, "block %u has neither a reference nor a full level with a half-buffer difference",
                         block->id);
    s.spp = malloc(((size_t)s.recorded + MAX_SIMULATED) * sizeof *s.spp);
    s.base = malloc(9 * pixels * sizeof *s.base);
    s.converged = malloc(3 * pixels);
    int rc = s.spp && s.base && s.converged ? 0 : base_fail_nomem(err, "observer");
    s.difference = s.base ? s.base + 3 * pixels : NULL;
    s.work = s.base ? s.base + 6 * pixels : NULL;
    s.spp0 = full ? full->spp : 0.0;
    if (!rc && !reference) { /* the mean of the full level stands for the converged image */
        rc = seq_halves(block, full, s.base, s.difference, err);
        if (!rc)
            encode(s.base, pixels, s.converged);
    } else if (!rc) {
        rc = s.scale ? seq_mean(block, reference, s.base, err) : 0;
        if (!rc && extend)
            rc = seq_half(block, full, s.difference, err);
        if (!rc)
            rc = seq_display(block, reference, s.converged, err);
    }
    if (rc) {
        ggn_stimuli_release(&s);
        return rc;
    }
    for (; s.n < s.recorded; s.n++)
        s.spp[s.n] = block->levels[s.n].spp;
    uint32_t all[MAX_SIMULATED];
    const int count = extend || s.recorded == 0 ? seq_levels(20, SEQ_STUDY_CAP, 1.15, 1, all, MAX_SIMULATED) : 0;
    for (int i = 0; i < count; i++)
        if (all[i] > beyond)
            s.spp[s.n++] = all[i];
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
