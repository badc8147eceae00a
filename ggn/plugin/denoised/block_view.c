#include "plugin/denoised/block_view.h"

#include "base/colour.h"
#include "denoise/blend.h"
#include "model/visibility.h"
#include "plugin/translate.h"
#include "sequence/simulate.h"

/* --- memory ------------------------------------------------------------------------------------------------------------ */

static int32_t most(int32_t a, int32_t b) { return a > b ? a : b; }

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }

/* A side with what is denoised around it, as far as the frame's blocks and their margin reach: 0 < side <= area. */
static int32_t widened(int32_t side, int32_t area)
{
    const int64_t around = (int64_t)side + GD_REACH + GD_HALO, whole = (int64_t)area + 2 * LULL_OIDN_MARGIN;
    const int64_t wide = around < whole ? around : whole;
    return wide < INT32_MAX ? (int32_t)wide : INT32_MAX; /* there is no memory for it */
}

struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality)
{
    struct gd_form form = {.area = *lull_kit_rect(frame, 0)};
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        form.area = (struct lull_rect){least(form.area.x0, r->x0), least(form.area.y0, r->y0), most(form.area.x1, r->x1),
                                       most(form.area.y1, r->y1)};
        form.width = most(form.width, r->x1 - r->x0);
        form.height = most(form.height, r->y1 - r->y0);
    }
    form.box.width = widened(form.width, form.area.x1 - form.area.x0);
    form.box.height = widened(form.height, form.area.y1 - form.area.y0);
    form.box.albedo = (frame->planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO)) != 0;
    form.box.normal = form.box.albedo && (frame->planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL)) != 0;
    form.box.quality = (int32_t)quality;
    form.box.threads = 1;
    form.box.exposure = isfinite(frame->exposure) && frame->exposure > 0 ? (float)frame->exposure : 1.0f;
    return form;
}

int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, const char *library, struct base_err *err)
{
    const size_t pixels = (size_t)form->width * (size_t)form->height;
    const struct lull_denoised_form pair = {.picture = form->box, .part_pixels = pixels};
    struct gd_block_view v = {0};
    float **const maps[] = {&v.noisy_light[0],
                            &v.noisy_light[1],
                            &v.denoised_light[0],
                            &v.denoised_light[1],
                            &v.crossed_light[0],
                            &v.crossed_light[1],
                            &v.kept_light[0],
                            &v.kept_light[1],
                            &v.lightness[0],
                            &v.lightness[1],
                            &v.apart_lightness[0],
                            &v.apart_lightness[1],
                            &v.slope,
                            &v.apart,
                            &v.weight};
    float **const pictures[] = {&v.rgb, &v.around, &v.crossed[0], &v.crossed[1], &v.kept[0], &v.kept[1]};
    enum { MAPS = sizeof maps / sizeof maps[0], PICTURES = sizeof pictures / sizeof pictures[0] };
    int rc = form->area.x1 > INT32_MAX / 2 || form->area.y1 > INT32_MAX / 2
                 ? base_fail_nomem(err, "the pictures of a block")
                 : lull_denoised_open(&v.pair, library, &pair, err);
    if (rc) /* after it P is known to be small enough for sums below */
        return rc;
    const size_t doubles = ggn_kept_scratch(form->width, form->height);
    v.memory = malloc(doubles * sizeof(double) + (MAPS + 3 * PICTURES) * pixels * sizeof(float));
    if (!v.memory) {
        gd_block_view_release(&v);
        return base_fail_nomem(err, "the pictures of a block");
    }
    v.judging = v.memory;
    float *next = (float *)(v.judging + doubles);
    for (size_t i = 0; i < MAPS; i++, next += pixels)
        *maps[i] = next;
    for (size_t i = 0; i < PICTURES; i++, next += 3 * pixels)
        *pictures[i] = next;
    *seen = v;
    return 0;
}

void gd_block_view_release(struct gd_block_view *seen)
{
    lull_denoised_close(&seen->pair);
    free(seen->memory);
    *seen = (struct gd_block_view){0};
}

/* --- reading ----------------------------------------------------------------------------------------------------------- */

/* Where along one side a box begins: its corner is on the denoiser's grid, and it holds the block and its halo as far as the
 * margin of the frame, where the picture that is kept ends, too. */
static int32_t corner(int32_t area0, int32_t area1, int32_t box, int32_t block0)
{
    const int32_t from = least(block0 - GD_HALO, area1 + LULL_OIDN_MARGIN - box) - (area0 - LULL_OIDN_MARGIN);
    return area0 - LULL_OIDN_MARGIN + (from > 0 ? from / LULL_OIDN_GRID * LULL_OIDN_GRID : 0);
}

static struct lull_rect box_of(const struct gd_form *form, const struct lull_block *b)
{
    const int32_t x0 = corner(form->area.x0, form->area.x1, form->box.width, b->x0);
    const int32_t y0 = corner(form->area.y0, form->area.y1, form->box.height, b->y0);
    return (struct lull_rect){x0, y0, x0 + form->box.width, y0 + form->box.height};
}

static struct lull_rect common(struct lull_rect a, struct lull_rect b)
{
    return (struct lull_rect){most(a.x0, b.x0), most(a.y0, b.y0), least(a.x1, b.x1), least(a.y1, b.y1)};
}

/* A rectangle of the frame in its box. */
static struct lull_denoised_rect in_box(struct lull_rect r, struct lull_rect box)
{
    return (struct lull_denoised_rect){r.x0 - box.x0, r.y0 - box.y0, r.x1 - box.x0, r.y1 - box.y0};
}

/* What is no number is as the pixel to the left, which may be a copy itself; the first ones of a row are black. */
static void replace(struct lull_denoised_pair *pair, size_t at, int before)
{
    for (int k = 0; k < 2; k++)
        for (size_t c = 3 * at; c < 3 * at + 3; c++)
            pair->half[k][c] = before ? pair->half[k][c - 3] : 0.0f;
}

/* Whether a pixel's halves differ, as far as they are numbers. */
static int differs(const double mean[3], const double half[3])
{
    int yes = 0;
    for (int c = 0; c < 3; c++)
        yes |= half[c] != mean[c] && isfinite(half[c]) && isfinite(mean[c]);
    return yes;
}

/* The pixels of `rect`, which are of block b, go into the box. Returns whether the halves differ anywhere. */
static int read_part(struct gd_block_view *seen, struct lull_rect rect, const struct lull_view *view,
                     const struct lull_block *b, uint32_t planes, struct lull_kit_tally *tally)
{
    const double n = (double)b->spp, h = (double)b->half_spp;
    const size_t row = (size_t)(seen->box.x1 - seen->box.x0);
    struct lull_denoised_pair *pair = &seen->pair;
    struct lull_block part = *b;
    struct lull_kit_span s;
    int differ = 0;
    part.x0 = rect.x0, part.y0 = rect.y0, part.x1 = rect.x1, part.y1 = rect.y1;
    if (rect.x0 >= rect.x1 || rect.y0 >= rect.y1)
        return 0;
    for (lull_kit_span_begin(&s, view, &part, planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const size_t at = (size_t)(s.y - seen->box.y0) * row + (size_t)(s.x + i - seen->box.x0);
            const double *mean = s.value[LULL_PLANE_COLOR][i], *half = s.value[LULL_PLANE_HALF][i];
            const int good = lull_denoised_put(pair, at, mean, half, n, h);
            tally->valid += good;
            tally->bad += !good;
            differ |= gp_has_halves(b) && differs(mean, half);
            if (!good)
                replace(pair, at, s.x + i > rect.x0);
            for (size_t c = 0; c < 3; c++) {
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_ALBEDO))
                    pair->albedo[3 * at + c] = (float)s.value[LULL_PLANE_ALBEDO][i][c];
                if (s.planes & LULL_PLANE_BIT(LULL_PLANE_NORMAL))
                    pair->normal[3 * at + c] = (float)s.value[LULL_PLANE_NORMAL][i][c];
            }
        }
    return differ;
}

int gd_block_view_read(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                       const struct lull_view *view, const struct lull_block *b, struct lull_kit_tally *tally)
{
    const struct lull_rect core = {b->x0, b->y0, b->x1, b->y1};
    const uint32_t planes = kit->need.planes_required | (form->box.albedo ? LULL_PLANE_BIT(LULL_PLANE_ALBEDO) : 0) |
                            (form->box.normal ? LULL_PLANE_BIT(LULL_PLANE_NORMAL) : 0);
    struct lull_rect known = core;
    struct lull_kit_tally around = {0};
    seen->box = box_of(form, b);
    lull_denoised_clear(&seen->pair);
    if (view->all) {
        known = (struct lull_rect){b->x0 - GD_REACH, b->y0 - GD_REACH, b->x1 + GD_REACH, b->y1 + GD_REACH};
        known = common(common(known, form->area), seen->box);
    }
    for (uint32_t i = 0; view->all && i < view->all_count; i++) {
        const struct lull_block *other = lull_kit_at(view->all, view->all_stride, i);
        const struct lull_rect r = {other->x0, other->y0, other->x1, other->y1};
        if (other->id != b->id && other->spp > 0)
            read_part(seen, common(r, known), view, other, planes, &around);
    }
    const int differ = read_part(seen, core, view, b, planes, tally);
    lull_denoised_mirror(&seen->pair, in_box(known, seen->box));
    return differ;
}

int gd_block_view_structure(struct gd_block_view *seen, const struct lull_block *b)
{
    const struct lull_rect core = {b->x0, b->y0, b->x1, b->y1};
    const struct lull_denoised_part *part = &seen->pair.part;
    lull_denoised_cut(&seen->pair, in_box(core, seen->box));
    for (size_t i = 1; i < part->pixels; i++)
        if (memcmp(part->half[0], part->half[0] + 3 * i, 3 * sizeof(float)) != 0)
            return 1;
    return 0;
}

/* --- what a display shows ---------------------------------------------------------------------------------------------- */

/* Luminance of the light that it sends for a picture [P][3]; lightness: L* of it, or NULL. */
static void show(struct gd_block_view *seen, const struct lull_kit *kit, const float *picture, float *light,
                 float *lightness)
{
    const size_t pixels = seen->pair.part.pixels;
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
    const struct lull_denoised_part *part = &seen->pair.part;
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
    struct lull_denoised_pair *pair = &seen->pair;
    const struct lull_denoised_part *part = &pair->part;
    const struct lull_estimate_in in = {seen->noisy_light[0], seen->noisy_light[1], seen->denoised_light[0],
                                        seen->denoised_light[1], share};
    lull_denoised_estimate(pair, 0, part->pixels, &in);
    lull_blend_weights_blind(&part->error, part->width, part->height, seen->around, seen->weight);
    lull_denoised_weigh(pair);
    lull_denoised_blend(pair, seen->weight, seen->crossed);
    lull_denoised_blend(pair, part->weight, seen->kept);
}

/* The denoised picture alone is both, specks and all. */
static void keep_denoised(struct gd_block_view *seen)
{
    const struct lull_denoised_part *part = &seen->pair.part;
    for (int k = 0; k < 2; k++) {
        memcpy(seen->crossed[k], part->denoised[k], 3 * part->pixels * sizeof(float));
        memcpy(seen->kept[k], part->denoised[k], 3 * part->pixels * sizeof(float));
    }
}

/* How far apart the kept halves are, at the strength of the mean: L* of the mean less that of the darker half. A speck that
 * one sample made is in one half alone; half the difference of L* of the halves would be too little, L* being concave.
 * split: what makes a difference of halves as strong as the mean's noise. */
static void show_apart(struct gd_block_view *seen, const struct lull_kit *kit, double split)
{
    const size_t pixels = seen->pair.part.pixels;
    for (int k = 0; k < 2; k++) {
        for (size_t i = 0; i < pixels; i++) {
            const int darker = seen->kept_light[0][i] > seen->kept_light[1][i];
            const float *low = seen->kept[darker] + 3 * i, *high = seen->kept[!darker] + 3 * i;
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

/* --- judging ----------------------------------------------------------------------------------------------------------- */

static int cancelled(void *data)
{
    const struct lull_host *host = *(const struct lull_host **)data;
    return host->cancelled(host);
}

int gd_block_view_errors(struct gd_block_view *seen, const struct lull_kit *kit, const struct lull_block *b, int blend,
                         const struct ggn_temporal *temporal, struct ggn_kept_errors *errors)
{
    const struct lull_rect core = {b->x0, b->y0, b->x1, b->y1};
    const double n = (double)b->spp, h = (double)b->half_spp;
    const struct lull_host *host = kit->host;
    seen->err = (struct base_err){0};
    if (lull_denoised_run(&seen->pair, host && host->cancelled ? cancelled : NULL, &host, &seen->err))
        return seen->err.code;
    lull_denoised_cut(&seen->pair, in_box(core, seen->box));
    show_halves(seen, kit);
    if (blend)
        blend_halves(seen, h / n);
    else
        keep_denoised(seen);
    for (int k = 0; k < 2; k++) {
        show(seen, kit, seen->crossed[k], seen->crossed_light[k], NULL);
        show(seen, kit, seen->kept[k], seen->kept_light[k], NULL);
    }
    show_apart(seen, kit, 0.5 * seq_half_scale(n, h));
    const struct ggn_kept kept = {.width = seen->pair.part.width,
                                  .height = seen->pair.part.height,
                                  .lightness = {seen->lightness[0], seen->lightness[1]},
                                  .slope = seen->slope,
                                  .noisy = {seen->noisy_light[0], seen->noisy_light[1]},
                                  .crossed = {seen->crossed_light[0], seen->crossed_light[1]},
                                  .apart = seen->apart};
    *errors = ggn_kept_judge(&kept, temporal, seen->judging);
    return 0;
}
