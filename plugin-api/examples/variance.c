/* SPDX-License-Identifier: MIT
 *
 * Relative standard error of the mean, from the second moment.
 *
 * Per pixel, with Y the displayed luminance before the transfer curve and n its samples:
 *     var(mean Y) = (mean Y^2 - (mean Y)^2) / (n - 1)
 *     e = sqrt(var(mean Y)) / max(|mean Y|, floor)
 * and per block the root mean square of e. It overestimates the error of stratified or low-discrepancy samples, and a
 * source of light that no sample has found yet does not show in it.
 */
#include "support.h"

enum { THRESHOLD, FLOOR, TAIL_ERROR, TAIL_SHARE, FIRST_SPP, GROWTH, PARAM_COUNT };

static const struct lull_param params[PARAM_COUNT] = {
    [THRESHOLD] = {.name = "threshold",
                   .help = "stop when the block's relative standard error is at most this",
                   .default_value = "0.03",
                   .min = 0,
                   .max = 1e6,
                   .type = LULL_PARAM_FLOAT},
    [FLOOR] = {.name = "floor",
               .help = "luminance (1 = display white) below which errors count as absolute",
               .default_value = "0.02",
               .min = 1e-6,
               .max = 1e6,
               .type = LULL_PARAM_FLOAT},
    [TAIL_ERROR] = {.name = "tail-error",
                    .help = "a pixel with a larger relative standard error is not settled",
                    .default_value = "0.5",
                    .min = 1e-6,
                    .max = 1e30,
                    .type = LULL_PARAM_FLOAT},
    [TAIL_SHARE] = {.name = "tail-share",
                    .help = "share of pixels that need not be settled when the block stops",
                    .default_value = "0",
                    .min = 0,
                    .max = 1,
                    .type = LULL_PARAM_FLOAT},
    [FIRST_SPP] = {.name = "first-spp",
                   .help = "samples per pixel before the first judgement",
                   .default_value = "16",
                   .min = 2,
                   .max = 1e15,
                   .type = LULL_PARAM_INT},
    [GROWTH] = {.name = "growth",
                .help = "largest ratio of samples between two checks of a block",
                .default_value = "1.5",
                .min = 1.01,
                .max = 100,
                .type = LULL_PARAM_FLOAT},
};

enum { CHUNK = 128 };

static void tally_pixel(const struct lull_instance *in, const double rgb[3], double moment2, double n, struct ex_tally *t)
{
    double y = ex_luminance(in, rgb), y2 = in->exposure * in->exposure * moment2;
    if (!isfinite(y) || !isfinite(y2) || !isfinite(n)) {
        t->bad++;
        return;
    }
    if (n < 2) {
        t->early++;
        return;
    }
    double variance_of_mean = fmax(y2 - y * y, 0) / (n - 1);
    double level = fmax(fabs(y), in->value[FLOOR]);
    double e = sqrt(variance_of_mean) / level;
    t->sum += e * e;
    t->valid++;
    t->unsettled += e > in->value[TAIL_ERROR];
}

static void judge(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision)
{
    const struct lull_plane *color = ex_plane(view, LULL_PLANE_COLOR), *moment2 = ex_plane(view, LULL_PLANE_MOMENT2);
    const struct lull_plane *spp = ex_plane(view, LULL_PLANE_SPP);
    struct ex_tally tally = {0};
    if (block->spp >= ex_first_spp(in))
        for (int32_t y = block->y0; y < block->y1; y++)
            for (int32_t x = block->x0; x < block->x1;) {
                int32_t count = block->x1 - x < CHUNK ? block->x1 - x : CHUNK;
                double rgb[CHUNK][3], m2[CHUNK], n[CHUNK];
                ex_span(view, color, block, x, y, count, 3, rgb[0]);
                ex_span(view, moment2, block, x, y, count, 1, m2);
                if (spp)
                    ex_span(view, spp, block, x, y, count, 1, n);
                for (int32_t i = 0; i < count; i++)
                    tally_pixel(in, rgb[i], m2[i], spp ? n[i] : (double)block->spp, &tally);
                x += count;
            }
    double error = tally.valid > 0 ? sqrt(tally.sum / tally.valid) : (double)NAN;
    ex_verdict(in, block, &tally, error, in->value[THRESHOLD], in->value[TAIL_SHARE], in->value[GROWTH], decision);
}

static const struct ex_rule ex_rule = {
    .params = params,
    .param_count = PARAM_COUNT,
    .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_MOMENT2),
    .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_MOMENT2) | LULL_PLANE_BIT(LULL_PLANE_SPP),
    .first_spp_param = FIRST_SPP,
    .judge = judge,
};

static const struct lull_criterion variance_criterion = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "variance",
    .name = "Relative standard error",
    .version = "1.0",
    .description = "Root mean square over the block of each pixel's standard error of the mean luminance, relative to that\n"
                   "luminance. A block with a pixel that hangs on one rare bright sample is not stopped.",
    .params = params,
    .param_count = PARAM_COUNT,
    .param_stride = sizeof(struct lull_param),
    .thread_level = LULL_THREADS_FULL,
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    EX_FUNCTIONS,
};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index == 0 ? &variance_criterion : NULL;
}
