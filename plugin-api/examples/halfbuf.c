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
#include "support.h"

/* The default threshold: in a picture of 5 x 5 blocks it is a standard error of about 3 % at a grey of 0.2. */
enum { THRESHOLD, AREA, FLOOR, TAIL_ERROR, TAIL_SHARE, FIRST_SPP, GROWTH, PARAM_COUNT };

static const struct lull_param params[PARAM_COUNT] = {
    [THRESHOLD] = {.name = "threshold",
                   .help = "stop when the block's error is at most this",
                   .default_value = "0.004",
                   .min = 0,
                   .max = 1e6,
                   .type = LULL_PARAM_FLOAT},
    [AREA] = {.name = "area",
              .help = "weigh the error by sqrt(block pixels / picture pixels), as the paper does",
              .default_value = "1",
              .max = 1,
              .type = LULL_PARAM_BOOL},
    [FLOOR] = {.name = "floor",
               .help = "luminance (1 = display white) below which the tail guard counts differences as absolute",
               .default_value = "0.02",
               .min = 1e-6,
               .max = 1e6,
               .type = LULL_PARAM_FLOAT},
    [TAIL_ERROR] = {.name = "tail-error",
                    .help = "a pixel whose buffers differ by more than this share is not settled",
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

static void tally_pixel(const struct lull_instance *in, const double full[3], const double half[3], double split,
                        struct ex_tally *t)
{
    double y = ex_luminance(in, full), y_half = ex_luminance(in, half);
    double sum = fabs(full[0] + full[1] + full[2]);
    double difference = fabs(full[0] - half[0]) + fabs(full[1] - half[1]) + fabs(full[2] - half[2]);
    if (!isfinite(y) || !isfinite(y_half) || !isfinite(sum) || !isfinite(difference)) {
        t->bad++;
        return;
    }
    /* A sum of 0 with a difference is possible with negative values only; any positive denominator serves it. */
    double e = difference == 0 ? 0 : split * sqrt(in->exposure) * difference / sqrt(fmax(sum, 1e-3 * difference));
    t->sum += e;
    t->valid++;
    t->unsettled += split * fabs(y - y_half) > in->value[TAIL_ERROR] * fmax(fabs(y), in->value[FLOOR]);
}

static void judge(const struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision)
{
    const struct lull_plane *color = ex_plane(view, LULL_PLANE_COLOR), *half = ex_plane(view, LULL_PLANE_HALF);
    struct ex_tally tally = {0};
    double spp = (double)block->spp, half_spp = (double)block->half_spp;
    if (half_spp <= 0 || half_spp >= spp)
        tally.early = 1; /* two buffers with the same samples would never differ */
    else if (block->spp >= ex_first_spp(in)) {
        double split = sqrt(half_spp / (spp - half_spp));
        for (int32_t y = block->y0; y < block->y1; y++)
            for (int32_t x = block->x0; x < block->x1;) {
                int32_t count = block->x1 - x < CHUNK ? block->x1 - x : CHUNK;
                double a[CHUNK][3], b[CHUNK][3];
                ex_span(view, color, block, x, y, count, 3, a[0]);
                ex_span(view, half, block, x, y, count, 3, b[0]);
                for (int32_t i = 0; i < count; i++)
                    tally_pixel(in, a[i], b[i], split, &tally);
                x += count;
            }
    }
    double area = in->value[AREA] != 0 ? sqrt(fmin(ex_block_pixels(block) / in->picture_pixels, 1)) : 1;
    double error = tally.valid > 0 ? area * tally.sum / tally.valid : (double)NAN;
    ex_verdict(in, block, &tally, error, in->value[THRESHOLD], in->value[TAIL_SHARE], in->value[GROWTH], decision);
}

static const struct ex_rule ex_rule = {
    .params = params,
    .param_count = PARAM_COUNT,
    .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF),
    .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF),
    .first_spp_param = FIRST_SPP,
    .judge = judge,
};

static const struct lull_criterion halfbuf_criterion = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "halfbuf",
    .name = "Two-buffer error",
    .version = "1.0",
    .description = "Mean over the block of the scaled difference between the image of all samples and that of half of them\n"
                   "(Dammertz et al. 2010), with a guard against rare bright paths: a block with a pixel that hangs on one\n"
                   "sample is not stopped.",
    .params = params,
    .param_count = PARAM_COUNT,
    .param_stride = sizeof(struct lull_param),
    .thread_level = LULL_THREADS_FULL,
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    EX_FUNCTIONS,
};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index == 0 ? &halfbuf_criterion : NULL;
}
