/* SPDX-License-Identifier: MIT
 *
 * Two-buffer error per block: Dammertz, Hanika, Keller, Lensch, "A Hierarchical Automatic Stopping Condition for Monte
 * Carlo Global Illumination", WSCG 2010. With I the image of all samples and A that of a half of them, per pixel (eq. 1)
 *     e = (|I_r - A_r| + |I_g - A_g| + |I_b - A_b|) / sqrt(I_r + I_g + I_b)
 * and per block the mean of e times sqrt(block pixels / picture pixels). Blocks here are given, not split.
 *
 * Three additions: values are exposed to the display's scale; a difference is scaled by sqrt(h / (n - h)), which is 1 for
 * the paper's h = n / 2 and keeps a threshold's meaning for other splits (var(I - A) = var * (1/h - 1/n)); and a guard
 * against rare bright paths, which a mean over 40,000 pixels cannot see: in a pixel that one sample dominates, I and A
 * differ by about I itself, so a block stops only if (almost) no pixel differs by as much as tail-error of its luminance.
 */
#include <lull/criterion_kit.h>

enum { THRESHOLD, AREA, FLOOR, TAIL_ERROR, TAIL_SHARE, FIRST_SPP, GROWTH, PARAM_COUNT };
enum { PLANES = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) };

/* The default threshold: in a picture of 5 x 5 blocks it is a standard error of about 3 % at a grey of 0.2. */
static const struct lull_param params[PARAM_COUNT] = {
    [THRESHOLD] = LULL_KIT_FLOAT("threshold", "0.004", 0, 1e6, "stop when the block's error is at most this"),
    [AREA] = LULL_KIT_BOOL("area", "1", "weigh the error by sqrt(block pixels / picture pixels), as the paper does"),
    [FLOOR] = LULL_KIT_FLOAT("floor", "0.02", 1e-6, 1e6,
                             "luminance (1 = display white) below which the tail guard counts differences as absolute"),
    [TAIL_ERROR] = LULL_KIT_FLOAT("tail-error", "0.5", 1e-6, 1e30,
                                  "a pixel whose buffers differ by more than this share is not settled"),
    [TAIL_SHARE] = LULL_KIT_FLOAT("tail-share", "0", 0, 1, "share of pixels that need not be settled when the block stops"),
    [FIRST_SPP] = LULL_KIT_INT("first-spp", "16", 2, 1e15, "samples per pixel before the first judgement"),
    [GROWTH] = LULL_KIT_FLOAT("growth", "1.5", 1.01, 100, "largest ratio of samples between two checks of a block"),
};

static void tally_pixel(const struct lull_kit *kit, const double full[3], const double half[3], double split,
                        struct lull_kit_tally *t)
{
    double y = kit->exposure * lull_kit_luminance(kit, full), y_half = kit->exposure * lull_kit_luminance(kit, half);
    double sum = fabs(full[0] + full[1] + full[2]);
    double difference = fabs(full[0] - half[0]) + fabs(full[1] - half[1]) + fabs(full[2] - half[2]);
    if (!isfinite(y) || !isfinite(y_half) || !isfinite(sum) || !isfinite(difference)) {
        t->bad++;
        return;
    }
    /* A sum of 0 with a difference is possible with negative values only; any positive denominator serves it. */
    t->sum += difference == 0 ? 0 : split * sqrt(kit->exposure) * difference / sqrt(fmax(sum, 1e-3 * difference));
    t->valid++;
    t->unsettled += split * fabs(y - y_half) > kit->value[TAIL_ERROR] * fmax(fabs(y), kit->value[FLOOR]);
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker)
{
    (void)worker;
    const struct lull_kit *kit = lull_kit_of(in);
    const double *value = kit->value, n = (double)block->spp, h = (double)block->half_spp;
    struct lull_kit_tally tally = {0};
    struct lull_kit_span s;
    if (h <= 0 || h >= n)
        tally.early = 1; /* two buffers with the same samples would never differ */
    else if (block->spp >= kit->need.first_spp)
        for (lull_kit_span_begin(&s, view, block, PLANES); lull_kit_span_next(&s);)
            for (int32_t i = 0; i < s.count; i++)
                tally_pixel(kit, s.value[LULL_PLANE_COLOR][i], s.value[LULL_PLANE_HALF][i], sqrt(h / (n - h)), &tally);
    double area = value[AREA] != 0 ? sqrt(fmin(lull_kit_pixels(block) / kit->picture_pixels, 1)) : 1;
    double error = tally.valid > 0 ? area * tally.sum / tally.valid : (double)NAN;
    lull_kit_verdict(kit, block, &tally, error, value[THRESHOLD], value[TAIL_SHARE], value[GROWTH], decision);
}

static const struct lull_kit_rule rule = {
    .planes_required = PLANES, .planes_used = PLANES, .first_spp = "first-spp", .judge = judge};

LULL_KIT_CRITERION(rule, params, PARAM_COUNT, "halfbuf", "Two-buffer error", "1.0",
                   "Mean over the block of the scaled difference between the image of all samples and that of half of them\n"
                   "(Dammertz et al. 2010), with a guard against rare bright paths: a block with a pixel that hangs on one\n"
                   "sample is not stopped.");
