#include "render/outlook.h"

#include <math.h>
#include <stdlib.h>

/* Half an interval that holds 8 of 10 blocks, in octaves of samples: luck in the last checks, and so much more for each
 * octave that the prediction looks ahead. Fitted to 43 blocks of seven renders and 61 of 33 recordings (docs/quote.md). */
static const double NEAR = 0.15, PER_OCTAVE = 0.08, UNMET = 1.0;

static double half_width(const struct pt_outlook_said *said, double end)
{
    double ahead = log2(end / (double)said->spp);
    return said->unmet ? UNMET : NEAR + PER_OCTAVE * fmax(ahead, 0.0);
}

struct pt_outlook_stop pt_outlook_stop(const struct pt_outlook_said *said, uint64_t spp, uint64_t spp_max)
{
    double has = (double)spp, most = (double)spp_max;
    if (said->spp == 0 || !isfinite(said->predicted))
        return (struct pt_outlook_stop){.spp = most, .low = has, .high = most};
    double end = fmin(fmax(said->predicted, 1.0), most);
    if (said->stopped)
        return (struct pt_outlook_stop){end, end, end, 1};
    double factor = exp2(half_width(said, end));
    end = fmax(end, has);
    return (struct pt_outlook_stop){end, fmax(end / factor, has), fmin(end * factor, most), 1};
}

struct pt_outlook_stop pt_outlook_of_block(const struct pt_block *b, int uniform, uint64_t spp_max)
{
    struct pt_outlook_said said = {.spp = b->asked ? b->asked_spp : 0, .predicted = b->predicted_spp};
    double most = (double)spp_max, has = (double)b->spp;
    if (b->reason != PT_REASON_NONE)
        return (struct pt_outlook_stop){has, has, has, 1};
    if (uniform)
        return (struct pt_outlook_stop){most, most, most, 1};
    struct pt_outlook_stop stop = pt_outlook_stop(&said, b->spp, spp_max);
    stop.spp = fmax(stop.spp, (double)b->next_spp); /* nobody asks before */
    return stop;
}

double pt_outlook_checks(const struct pt_block *b, double spp)
{
    double next = (double)b->next_spp, ratio = b->asked ? next / (double)b->asked_spp : 1.5;
    if (b->reason != PT_REASON_NONE)
        return 0.0;
    return 1.0 + (spp > next && ratio > 1.0 ? log(spp / next) / log(ratio) : 0.0);
}

double pt_outlook_busy(long rows, int threads)
{
    long turns = (rows + threads - 1) / threads;
    return turns > 0 ? (double)rows / (double)turns : 0.0;
}

static int by_spp(const void *a, const void *b)
{
    const struct pt_outlook_work *x = a, *y = b;
    return (x->spp > y->spp) - (x->spp < y->spp);
}

double pt_outlook_wall_s(struct pt_outlook_work *work, uint32_t count, int threads)
{
    double wall_s = 0.0, per_spp_s = 0.0, done = 0.0;
    long rows = 0;
    qsort(work, count, sizeof *work, by_spp);
    for (uint32_t i = 0; i < count; i++) {
        rows += work[i].rows;
        per_spp_s += work[i].spp > 0.0 ? work[i].thread_s / work[i].spp : 0.0;
    }
    for (uint32_t i = 0; i < count; i++) { /* the blocks from i on are sampled from `done` to that of block i */
        if (work[i].spp > done)
            wall_s += (work[i].spp - done) * per_spp_s / pt_outlook_busy(rows, threads);
        done = work[i].spp;
        rows -= work[i].rows;
        per_spp_s -= work[i].spp > 0.0 ? work[i].thread_s / work[i].spp : 0.0;
    }
    return wall_s;
}
