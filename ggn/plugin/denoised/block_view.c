#include "plugin/denoised/block_view.h"

#include "base/colour.h"
#include "denoise/blend.h"
#include "sight/visibility.h"
#include "plugin/translate.h"
#include "sequence/simulate.h"

int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, struct base_err *err)
{
    const size_t pixels = (size_t)form->width * (size_t)form->height;
    struct gd_block_view v = {0};
    float **const pairs[] = {v.noisy_light, v.denoised_light, v.crossed_light, v.kept_light, v.lightness, v.apart_lightness};
    float **const maps[] = {&v.slope, &v.apart, &v.weight};
    float **const pictures[] = {&v.rgb, &v.crossed[0], &v.crossed[1], &v.kept[0], &v.kept[1]};
    enum { PAIRS = sizeof pairs / sizeof pairs[0], MAPS = sizeof maps / sizeof maps[0] };
    enum { PICTURES = sizeof pictures / sizeof pictures[0], AROUND = 2 };
    int rc = lull_denoised_part_open(&v.part, pixels, NULL, err);
    if (rc) /* after it P is known to be small enough for sums below */
        return rc;
    const size_t doubles = ggn_kept_scratch(form->width, form->height);
    v.memory = malloc(doubles * sizeof(double) + (2 * PAIRS + MAPS + 3 * PICTURES + AROUND) * pixels * sizeof(float));
    if (!v.memory) {
        gd_block_view_release(&v);
        return base_fail_nomem(err, "the pictures of a block");
    }
    v.judging = v.memory;
    float *next = (float *)(v.judging + doubles);
    for (size_t i = 0; i < 2 * PAIRS; i++, next += pixels)
        pairs[i / 2][i % 2] = next;
    for (size_t i = 0; i < MAPS; i++, next += pixels)
        *maps[i] = next;
    for (size_t i = 0; i < PICTURES; i++, next += 3 * pixels)
        *pictures[i] = next;
    v.around = next;
    *seen = v;
    return 0;
}

void gd_block_view_release(struct gd_block_view *seen)
{
    lull_denoised_part_close(&seen->part);
    free(seen->memory);
    *seen = (struct gd_block_view){0};
}

/* Luminance of the light that it sends for a picture [P][3]; lightness: L* of it, or NULL. */
static void show(struct gd_block_view *seen, const struct lull_kit *kit, const float *picture, float *light,
                 float *lightness)
{
    const size_t pixels = seen->part.pixels;
    for (size_t i = 0; i < pixels; i++) {
        for (size_t c = 0; c < 3; c++)
            seen->rgb[c * pixels + i] = gp_shown(kit, (double)picture[3 * i + c]);
        light[i] =
            (float)base_luminance((double)seen->rgb[i], (double)seen->rgb[pixels + i], (double)seen->rgb[2 * pixels + i]);
    }
    if (lightness)
        ggn_visible_lightness(seen->rgb, pixels, lightness);
}

static void show_halves(struct gd_block_view *seen, const struct lull_kit *kit)
{
    const struct lull_denoised_part *part = &seen->part;
    for (int k = 0; k < 2; k++) {
        show(seen, kit, part->half[k], seen->noisy_light[k], NULL);
        show(seen, kit, part->denoised[k], seen->denoised_light[k], seen->lightness[k]);
    }
    for (size_t i = 0; i < part->pixels; i++)
        seen->slope[i] =
            (float)lull_lightness_slope(0.5 * ((double)seen->denoised_light[0][i] + (double)seen->denoised_light[1][i]));
}

/* What is crossed and what is kept of both halves. share: of the samples that are in A. */
static void blend_halves(struct gd_block_view *seen, double share)
{
    struct lull_denoised_part *part = &seen->part;
    const struct lull_estimate_in in = {seen->noisy_light[0],
                                        seen->noisy_light[1],
                                        seen->denoised_light[0],
                                        seen->denoised_light[1],
                                        seen->noisy_light[0],
                                        seen->noisy_light[1],
                                        share};
    lull_denoised_estimate(part, 0, part->pixels, &in);
    lull_blend_weights_cross_validated(&part->error, part->width, part->height, seen->around, seen->weight);
    lull_denoised_weigh(part);
    lull_denoised_blend(part, seen->weight, seen->crossed);
    lull_denoised_blend(part, part->weight, seen->kept);
}

/* How far apart the kept halves are, at the strength of the mean: L* of the mean less that of the darker half. A speck that
 * one sample made is in one half alone; half the difference of L* of the halves would be too little, L* being concave.
 * split: what makes a difference of halves as strong as the mean's noise. */
static void show_apart(struct gd_block_view *seen, const struct lull_kit *kit, float *const kept[2], double split)
{
    const size_t pixels = seen->part.pixels;
    for (int k = 0; k < 2; k++) {
        for (size_t i = 0; i < pixels; i++) {
            const int darker = seen->kept_light[0][i] > seen->kept_light[1][i];
            const float *low = kept[darker] + 3 * i, *high = kept[!darker] + 3 * i;
            for (size_t c = 0; c < 3; c++) {
                const float mean = (float)((1.0 - split) * (double)low[c] + split * (double)high[c]);
                seen->rgb[c * pixels + i] = gp_shown(kit, (double)(k == darker ? low[c] : mean));
            }
        }
        ggn_visible_lightness(seen->rgb, pixels, seen->apart_lightness[k]);
    }
    for (size_t i = 0; i < pixels; i++)
        seen->apart[i] = seen->apart_lightness[0][i] - seen->apart_lightness[1][i];
}

struct ggn_kept_errors gd_block_view_errors(struct gd_block_view *seen, const struct gd_look *look,
                                            const struct lull_kit *kit, const struct lull_block *b, int blend,
                                            const struct ggn_viewing *viewing)
{
    const double n = (double)b->spp, h = (double)b->half_spp;
    lull_denoised_cut(&seen->part, &look->pair, gd_look_place(look, b));
    show_halves(seen, kit);
    if (blend)
        blend_halves(seen, h / n);
    /* The denoised picture alone is both, specks and all. */
    float *const *crossed = blend ? seen->crossed : seen->part.denoised, *const *kept = blend ? seen->kept : crossed;
    for (int k = 0; k < 2; k++) {
        show(seen, kit, crossed[k], seen->crossed_light[k], NULL);
        show(seen, kit, kept[k], seen->kept_light[k], NULL);
    }
    show_apart(seen, kit, kept, 0.5 * seq_half_scale(n, h));
    const struct ggn_kept judged = {.width = seen->part.width,
                                    .height = seen->part.height,
                                    .lightness = {seen->lightness[0], seen->lightness[1]},
                                    .slope = seen->slope,
                                    .noisy = {seen->noisy_light[0], seen->noisy_light[1]},
                                    .crossed = {seen->crossed_light[0], seen->crossed_light[1]},
                                    .apart = seen->apart};
    return ggn_kept_judge(&judged, viewing, seen->judging);
}
