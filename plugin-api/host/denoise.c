/* The picture that people keep: the denoised one, or what lies between it and the noisy one (denoise/blend.h). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lull/criterion_kit.h>

#include "denoise/blend.h"
#include "denoise/pair.h"
#include "host/frame.h"

/* The picture in the making, over the pixels of the view. */
struct picture {
    const struct lull_host_frame *frame;
    const struct lull_host_denoising *how;
    struct lull_view view;
    struct lull_denoised_pair pair; /* owns; of the whole view, */
    struct lull_denoised_part part; /* as this */
    float *const *other;            /* [2] borrows; by which the denoised halves are judged */
    float *mean;                    /* owns; [pixels][3]: of all samples */
};

static int is_full(const struct picture *p) { return (p->how->flags & LULL_DENOISE_FULL) != 0; }

/* What a pass over the pixels does with one run of them; at: index of its first pixel. */
typedef void visit(struct picture *p, const struct lull_kit_span *span, size_t at);

static void each_span(struct picture *p, uint32_t planes, visit *fn)
{
    const struct lull_host_blocks *blocks = &p->frame->blocks;
    for (uint32_t i = 0; i < blocks->count; i++) {
        if (blocks->list[i].spp == 0)
            continue;
        const struct lull_block b = lull_host_state_of(&blocks->list[i], i, 1);
        struct lull_kit_span s;
        for (lull_kit_span_begin(&s, &p->view, &b, planes); lull_kit_span_next(&s);)
            fn(p, &s, (size_t)(s.y - p->view.y0) * (size_t)p->pair.width + (size_t)(s.x - p->view.x0));
    }
}

static void read_pictures(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    float *const auxiliary[2] = {p->pair.albedo, p->pair.normal};
    for (size_t i = 0; i < (size_t)s->count; i++) {
        if (!is_full(p))
            lull_denoised_put(&p->pair, at + i, s->value[LULL_PLANE_COLOR][i], s->value[LULL_PLANE_HALF][i],
                              (double)s->block->spp, (double)s->block->half_spp);
        for (size_t c = 0; c < 3; c++) {
            p->mean[3 * (at + i) + c] = (float)s->value[LULL_PLANE_COLOR][i][c];
            for (int k = 0; k < 2; k++)
                if (auxiliary[k])
                    auxiliary[k][3 * (at + i) + c] = (float)s->value[LULL_PLANE_ALBEDO + k][i][c];
        }
    }
}

/* Luminance by which pictures are compared, 1 is the display's white: what is far beyond shows no noise. What is little
 * beyond counts as it is, since a noisy half that is cut off at white is darker than the truth in the mean. */
static float compared(const struct picture *p, const float *rgb)
{
    const double most = 4.0;
    double y = 0.0;
    for (int c = 0; c < 3; c++)
        y += p->frame->config.rgb_to_xyz[3 + c] * (double)rgb[c];
    y *= p->frame->config.exposure;
    return (float)(y > 0.0 ? fmin(y, most) : 0.0);
}

/* What the denoised halves gain by the others. Where there are no halves it stays 0: the denoised picture is kept. */
static void estimate(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    const struct lull_denoised_part *part = &p->part;
    const double share = (double)s->block->half_spp / (double)s->block->spp;
    float *const pictures[6] = {part->half[0],     part->half[1], part->denoised[0],
                                part->denoised[1], p->other[0],   p->other[1]};
    float light[6][LULL_KIT_SPAN_MAX];
    if (s->block->half_spp == 0 || s->block->half_spp >= s->block->spp)
        return;
    for (size_t i = 0; i < (size_t)s->count; i++)
        for (int k = 0; k < 6; k++)
            light[k][i] = compared(p, pictures[k] + 3 * (at + i));
    const struct lull_estimate_in in = {light[0], light[1], light[2], light[3], light[4], light[5], share};
    lull_denoised_estimate(&p->part, at, (size_t)s->count, &in);
}

/* Whether this is a draft that is as good as was asked: the criterion has stopped every block, and told of one that it shows
 * an error. Clean auxiliaries would take more than twice as long as the rest, for what nobody asked. */
static int is_draft(const struct picture *p)
{
    const struct lull_host_blocks *blocks = &p->frame->blocks;
    double worst = 0.0;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        if (b->reason != LULL_REASON_CRITERION || b->asked_spp != b->spp || isnan(b->error))
            return 0;
        worst = fmax(worst, b->error);
    }
    return worst > 1.0;
}

/* The mean of the denoised halves, and how much of the noisy picture each pixel takes. */
static int32_t denoise_halves(struct picture *p, float *denoised, struct lull_error *err)
{
    const struct lull_denoised_part *part = &p->part;
    struct base_err why = {0};
    if (lull_denoised_run(&p->pair, p->how->cancelled, p->how->context, &why) ||
        (!is_draft(p) && lull_denoised_again(&p->pair, p->how->cancelled, p->how->context, &why)))
        return lull_host_translate(&why, err);
    if (p->pair.other[0]) {
        p->other = p->pair.other;
        each_span(p, LULL_PLANE_BIT(LULL_PLANE_COLOR), estimate);
        lull_denoised_mix(&p->part, &p->pair);
    }
    p->other = part->half;
    each_span(p, LULL_PLANE_BIT(LULL_PLANE_COLOR), estimate);
    lull_denoised_weigh(&p->part);
    for (size_t i = 0; i < 3 * part->pixels; i++)
        denoised[i] = 0.5f * part->denoised[0][i] + 0.5f * part->denoised[1][i];
    return LULL_OK;
}

/* All samples at once; weight stays 0. */
static int32_t denoise_mean(struct picture *p, float *denoised, struct lull_error *err)
{
    const struct lull_oidn_pictures pictures = {
        .color = {p->mean}, .albedo = p->pair.albedo, .normal = p->pair.normal, .out = {denoised}};
    struct base_err why = {0};
    return lull_oidn_run(p->pair.oidn, &pictures, p->how->cancelled, p->how->context, &why) ? lull_host_translate(&why, err)
                                                                                            : LULL_OK;
}

/* The denoiser also paints where there are no samples yet. */
static void black_out(const struct picture *p, float *rgb)
{
    const struct lull_host_blocks *blocks = &p->frame->blocks;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        for (int32_t y = b->y0; b->spp == 0 && y < b->y1; y++)
            memset(rgb + 3 * ((size_t)(y - p->view.y0) * (size_t)p->pair.width + (size_t)(b->x0 - p->view.x0)), 0,
                   3 * (size_t)(b->x1 - b->x0) * sizeof *rgb);
    }
}

static int32_t make(struct picture *p, const struct lull_host_picture *out, struct lull_error *err)
{
    const struct lull_denoised_part *part = &p->part;
    const int albedo = lull_kit_plane(&p->view, LULL_PLANE_ALBEDO) != NULL;
    const struct lull_oidn_form form = {.width = p->view.x1 - p->view.x0,
                                        .height = p->view.y1 - p->view.y0,
                                        .albedo = albedo,
                                        .normal = albedo && lull_kit_plane(&p->view, LULL_PLANE_NORMAL),
                                        .quality = LULL_OIDN_HIGH,
                                        .threads = (int32_t)p->how->threads,
                                        .margin = LULL_OIDN_MARGIN,
                                        .exposure = (float)p->frame->config.exposure};
    struct base_err why = {0};
    if (lull_denoised_open(&p->pair, p->how->library, &form, &why) ||
        lull_denoised_part_open(&p->part, p->pair.pixels, &p->pair, &why))
        return lull_host_translate(&why, err);
    p->mean = calloc(3 * part->pixels, sizeof *p->mean);
    if (!p->mean)
        return lull_host_no_memory(err, "the denoised picture");
    float *denoised = out->denoised ? out->denoised : part->denoised[0];
    each_span(p,
              LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) | LULL_PLANE_BIT(LULL_PLANE_ALBEDO) |
                  LULL_PLANE_BIT(LULL_PLANE_NORMAL),
              read_pictures);
    const int32_t code = is_full(p) ? denoise_mean(p, denoised, err) : denoise_halves(p, denoised, err);
    if (code != LULL_OK)
        return code;
    black_out(p, denoised);
    lull_blend(p->mean, denoised, part->weight, part->pixels, out->rgb);
    if (out->weight)
        memcpy(out->weight, part->weight, part->pixels * sizeof *out->weight);
    return LULL_OK;
}

int32_t lull_host_denoise(const struct lull_host_frame *frame, const struct lull_host_view *view,
                          const struct lull_host_denoising *how, const struct lull_host_picture *out, struct lull_error *err)
{
    struct lull_host_shown s;
    int32_t code = lull_host_given(err, "frame", frame, "how", how, "out", out, "rgb", out ? out->rgb : NULL, NULL);
    if (code != LULL_OK)
        return code;
    if (how->struct_size < sizeof *how || out->struct_size < sizeof *out)
        return lull_error_set(err, LULL_E_VERSION, "a struct is smaller than in version 1.0");
    code = lull_host_show(&frame->blocks, view, 0, &s, err);
    if (code != LULL_OK)
        return code;
    struct picture p = {.frame = frame, .how = how, .view = s.view};
    if (!s.planes[LULL_PLANE_COLOR].data || (!is_full(&p) && !s.planes[LULL_PLANE_HALF].data))
        code = lull_error_set(err, LULL_E_INVALID, "a denoised picture needs the plane COLOR, a blend HALF besides");
    else
        code = make(&p, out, err);
    lull_denoised_part_close(&p.part);
    lull_denoised_close(&p.pair);
    free(p.mean);
    lull_host_hide(&s);
    return code;
}

int32_t lull_host_denoiser(const char *library, struct lull_error *err)
{
    struct lull_oidn *oidn = NULL;
    struct base_err why = {0};
    int rc = lull_oidn_open(library, &oidn, &why);
    lull_oidn_close(oidn);
    return rc ? lull_host_translate(&why, err) : LULL_OK;
}
