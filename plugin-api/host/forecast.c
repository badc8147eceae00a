#include "host/frame.h"

#include <math.h>
#include <stdio.h>
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

static void format_time(double s, char text[32])
{
    long t = (long)ceil(fmin(s, 3.6e7));
    if (t >= 3600)
        snprintf(text, 32, "%ld:%02ld:%02ld", t / 3600, t / 60 % 60, t % 60);
    else
        snprintf(text, 32, "%ld:%02ld", t / 60, t % 60);
}

/* The share done, which never falls: a prediction that grows holds it where it was. What is only a lower bound says so, and
 * says nothing while it is below a hundredth. */
static void format_share(double *percent_shown, double share, int known, char text[16])
{
    double percent = floor(100.0 * share);
    int is_bound = !known && percent >= *percent_shown;
    *percent_shown = fmax(*percent_shown, percent);
    if (is_bound && percent < 1.0)
        snprintf(text, 16, "  ?%%");
    else
        snprintf(text, 16, "%s%3.0f%%", is_bound ? ">=" : "", *percent_shown);
}

void lull_host_progress(const struct lull_host_blocks *blocks, const struct lull_host_totals *totals,
                        const struct lull_host_forecast *f, double time_budget_s, double left_s, double samples_per_s,
                        double *percent, char *text, uint64_t room)
{
    double share = f->left_s > 0.0 ? f->done_s / (f->done_s + f->left_s) : 1.0;
    double elapsed_s = totals->render_s + totals->criterion_s, budget_left_s = fmax(0.0, time_budget_s - elapsed_s);
    if (time_budget_s > 0.0 && budget_left_s < left_s) {
        left_s = budget_left_s;
        share = fmin(1.0, elapsed_s / time_budget_s);
    }
    char left[32] = "unknown", done[16];
    format_share(percent, share, f->known != 0, done);
    if (isfinite(left_s))
        format_time(left_s, left);
    snprintf(text, (size_t)room, "%s  %u of %u blocks active  spp %llu..%llu  %.2f Mpaths/s  ETA %s%s", done, f->active,
             blocks->count, (unsigned long long)(f->active > 0 ? f->low : 0), (unsigned long long)f->high,
             samples_per_s * 1e-6, f->known || !isfinite(left_s) ? "" : "at most ", left);
}
