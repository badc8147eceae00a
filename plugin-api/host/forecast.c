#include "host/frame.h"

#include <math.h>
#include <stdlib.h>

/* Half an interval that holds 8 of 10 blocks, in octaves of samples: luck in the last checks, and so much more for each
 * octave that the prediction looks ahead. Fitted to 43 blocks of seven renders and 61 of 33 recordings
 * (docs/results/quote.md). */
static const double NEAR = 0.15, PER_OCTAVE = 0.08, UNDERSAMPLED = 1.0;

struct lull_host_stop_at lull_host_expect(const struct lull_host_response *response, uint64_t spp, uint64_t spp_max)
{
    double has = (double)spp, most = (double)spp_max;
    if (response->spp == 0 || !isfinite(response->predicted))
        return (struct lull_host_stop_at){.spp = most, .low = has, .high = most};
    double end = fmin(fmax(response->predicted, 1.0), most);
    if (response->stopped)
        return (struct lull_host_stop_at){end, end, end, 1};
    double ahead = fmax(log2(end / (double)response->spp), 0.0);
    double factor = exp2(response->undersampled ? UNDERSAMPLED : NEAR + PER_OCTAVE * ahead);
    end = fmax(end, has);
    return (struct lull_host_stop_at){end, fmax(end / factor, has), fmin(end * factor, most), 1};
}

struct lull_host_stop_at lull_host_expect_block(const struct lull_host_blocks *blocks, const struct lull_host_block *b)
{
    struct lull_host_response response = {.spp = b->asked ? b->asked_spp : 0, .predicted = b->predicted_spp};
    double has = (double)b->spp;
    if (b->reason != LULL_REASON_NONE)
        return (struct lull_host_stop_at){has, has, has, 1};
    if (blocks->flags & LULL_HOST_UNIFORM) {
        double end = (double)b->next_spp;
        return (struct lull_host_stop_at){end, end, end, 1};
    }
    struct lull_host_stop_at stop = lull_host_expect(&response, b->spp, blocks->spp_max);
    stop.spp = fmax(stop.spp, (double)lull_host_goal(blocks, b)); /* nobody asks before */
    return stop;
}

double lull_host_expect_checks(const struct lull_host_block *b, double spp)
{
    double next = (double)b->next_spp, ratio = b->asked ? next / (double)b->asked_spp : 1.5;
    if (b->reason != LULL_REASON_NONE)
        return 0.0;
    return 1.0 + (spp > next && ratio > 1.0 ? log(spp / next) / log(ratio) : 0.0);
}

double lull_host_busy(int64_t rows, int32_t threads)
{
    int64_t turns = (rows + threads - 1) / threads;
    return turns > 0 ? (double)rows / (double)turns : 0.0;
}

static int by_spp(const void *a, const void *b)
{
    const struct lull_host_work *x = a, *y = b;
    return (x->spp > y->spp) - (x->spp < y->spp);
}

double lull_host_wall_s(struct lull_host_work *work, uint32_t count, int32_t threads)
{
    double wall_s = 0.0, per_spp_s = 0.0, done = 0.0;
    int64_t rows = 0;
    qsort(work, count, sizeof *work, by_spp);
    for (uint32_t i = 0; i < count; i++) {
        rows += work[i].rows;
        per_spp_s += work[i].spp > 0.0 ? work[i].thread_s / work[i].spp : 0.0;
    }
    for (uint32_t i = 0; i < count; i++) { /* the blocks from i on are sampled from `done` to that of block i */
        if (work[i].spp > done)
            wall_s += (work[i].spp - done) * per_spp_s / lull_host_busy(rows, threads);
        done = work[i].spp;
        rows -= work[i].rows;
        per_spp_s -= work[i].spp > 0.0 ? work[i].thread_s / work[i].spp : 0.0;
    }
    return wall_s;
}

/* What is left of one active block. */
static struct lull_host_work look_at(const struct lull_host_blocks *blocks, const struct lull_host_block *b,
                                     const struct lull_host_totals *totals, struct lull_host_forecast *f)
{
    struct lull_host_stop_at stop = lull_host_expect_block(blocks, b);
    double more = stop.spp - (double)b->spp, left_s = b->spp > 0 ? more * b->thread_s / (double)b->spp : 0.0;
    f->active++;
    f->low = b->spp < f->low ? b->spp : f->low;
    f->high = b->spp > f->high ? b->spp : f->high;
    f->known &= (uint32_t)stop.known;
    f->left_s += left_s;
    if (!(blocks->flags & LULL_HOST_UNIFORM) && totals->checks > 0)
        f->check_s += lull_host_expect_checks(b, stop.spp) * totals->criterion_s / (double)totals->checks;
    return (struct lull_host_work){more, left_s, b->y1 - b->y0};
}

int32_t lull_host_forecast_of(const struct lull_host_blocks *blocks, const struct lull_host_totals *totals, int32_t threads,
                              struct lull_host_forecast *out, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "blocks", blocks, "totals", totals, "out", out, NULL);
    if (code != LULL_OK)
        return code;
    if (threads < 1)
        return lull_error_set(err, LULL_E_INVALID, "%d threads: expected at least 1", threads);
    struct lull_host_forecast f = {.known = 1, .low = UINT64_MAX};
    struct lull_host_work *work = calloc(blocks->count, sizeof *work);
    if (!work)
        return lull_host_no_memory(err, "forecast");
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        f.done_s += b->thread_s;
        if (b->reason != LULL_REASON_NONE)
            continue;
        struct lull_host_work *one = &work[f.active];
        *one = look_at(blocks, b, totals, &f);
    }
    f.sampling_s = lull_host_wall_s(work, f.active, threads);
    free(work);
    *out = f;
    return LULL_OK;
}
