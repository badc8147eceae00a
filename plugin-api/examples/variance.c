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
#include <lull/criterion_kit.h>

enum { THRESHOLD, FLOOR, TAIL_ERROR, TAIL_SHARE, FIRST_SPP, GROWTH, PARAM_COUNT };
enum { PLANES = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_MOMENT2) };

static const struct lull_param params[PARAM_COUNT] = {
    [THRESHOLD] =
        LULL_KIT_FLOAT("threshold", "0.03", 0, 1e6, "stop when the block's relative standard error is at most this"),
    [FLOOR] =
        LULL_KIT_FLOAT("floor", "0.02", 1e-6, 1e6, "luminance (1 = display white) below which errors count as absolute"),
    [TAIL_ERROR] =
        LULL_KIT_FLOAT("tail-error", "0.5", 1e-6, 1e30, "a pixel with a larger relative standard error is not settled"),
    [TAIL_SHARE] = LULL_KIT_FLOAT("tail-share", "0", 0, 1, "share of pixels that need not be settled when the block stops"),
    [FIRST_SPP] = LULL_KIT_INT("first-spp", "16", 2, 1e15, "samples per pixel before the first judgement"),
    [GROWTH] = LULL_KIT_FLOAT("growth", "1.5", 1.01, 100, "largest ratio of samples between two checks of a block"),
};

static void tally_pixel(const struct lull_kit *kit, const double rgb[3], double moment2, double n, struct lull_kit_tally *t)
{
    double y = kit->exposure * lull_kit_luminance(kit, rgb), y2 = kit->exposure * kit->exposure * moment2;
    if (!isfinite(y) || !isfinite(y2) || !isfinite(n)) {
        t->bad++;
        return;
    }
    if (n < 2) {
        t->early++;
        return;
    }
    double variance_of_mean = fmax(y2 - y * y, 0) / (n - 1);
    double e = sqrt(variance_of_mean) / fmax(fabs(y), kit->value[FLOOR]);
    t->sum += e * e;
    t->valid++;
    t->unsettled += e > kit->value[TAIL_ERROR];
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker)
{
    (void)worker;
    const struct lull_kit *kit = lull_kit_of(in);
    const double *value = kit->value;
    struct lull_kit_tally tally = {0};
    struct lull_kit_span s;
    if (block->spp >= kit->need.first_spp)
        for (lull_kit_span_begin(&s, view, block, kit->need.planes_used); lull_kit_span_next(&s);)
            for (int32_t i = 0; i < s.count; i++) {
                double n = s.planes & LULL_PLANE_BIT(LULL_PLANE_SPP) ? s.value[LULL_PLANE_SPP][i][0] : (double)block->spp;
                tally_pixel(kit, s.value[LULL_PLANE_COLOR][i], s.value[LULL_PLANE_MOMENT2][i][0], n, &tally);
            }
    double error = tally.valid > 0 ? sqrt(tally.sum / tally.valid) : (double)NAN;
    lull_kit_verdict(kit, block, &tally, error, value[THRESHOLD], value[TAIL_SHARE], value[GROWTH], decision);
}

static const struct lull_kit_rule rule = {.planes_required = PLANES,
                                          .planes_used = PLANES | LULL_PLANE_BIT(LULL_PLANE_SPP),
                                          .first_spp = "first-spp",
                                          .judge = judge};

LULL_KIT_CRITERION(rule, params, PARAM_COUNT, "variance", "Relative standard error", "1.0",
                   "Root mean square over the block of each pixel's standard error of the mean luminance, relative to that\n"
                   "luminance. A block with a pixel that hangs on one rare bright sample is not stopped.");
