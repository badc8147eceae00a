/* The picture that people keep: the denoised one, or what lies between it and the noisy one (denoise/blend.h). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lull/criterion_kit.h>

#include "base/colour.h"
#include "denoise/blend.h"
#include "denoise/oidn.h"
#include "host/frame.h"

/* The picture in the making, over the pixels of the view. */
struct picture {
    const struct lull_host_frame *frame;
    const struct lull_host_denoising *how;
    struct lull_view view;
    int32_t width, height;
    size_t pixels;
    double exposure, luminance[3];
    struct lull_oidn *oidn;
    int albedo, normal;         /* whether the view has these */
    float *aux[2];              /* own; [n][3], NULL: not in the view */
    float *color[2], *clean[2]; /* own; [n][3]: both halves, later the mean of all samples alone */
    struct lull_estimate error; /* owns, [n] each */
};

static int32_t no_memory(struct lull_error *err) { return lull_host_no_memory(err, "the denoised picture"); }

static float *picture_alloc(const struct picture *p) { return calloc(p->pixels, 3 * sizeof(float)); }

static void picture_release(struct picture *p)
{
    for (int i = 0; i < 2; i++) {
        free(p->aux[i]);
        free(p->color[i]);
        free(p->clean[i]);
    }
    free(p->error.denoised);
    free(p->error.agreed);
    free(p->error.noisy);
    lull_oidn_close(p->oidn);
}

/* --- reading ----------------------------------------------------------------------------------------------------------- */

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
            fn(p, &s, (size_t)(s.y - p->view.y0) * (size_t)p->width + (size_t)(s.x - p->view.x0));
    }
}

static int has_halves(const struct lull_block *b) { return b->half_spp > 0 && b->half_spp < b->spp; }

/* Half A, and of the mean the rest; the mean twice where there is no second half. */
static void read_halves(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    const double n = (double)s->block->spp, h = (double)s->block->half_spp;
    const int split = has_halves(s->block);
    for (size_t i = 0; i < (size_t)s->count; i++)
        for (size_t c = 0; c < 3; c++) {
            const double m = s->value[LULL_PLANE_COLOR][i][c], half = s->value[LULL_PLANE_HALF][i][c];
            p->color[0][3 * (at + i) + c] = (float)(split ? half : m);
            p->color[1][3 * (at + i) + c] = (float)(split ? (n * m - h * half) / (n - h) : m);
        }
}

static void read_mean(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    for (size_t i = 0; i < (size_t)s->count; i++)
        for (size_t c = 0; c < 3; c++)
            p->color[0][3 * (at + i) + c] = (float)s->value[LULL_PLANE_COLOR][i][c];
}

static void read_auxiliary(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; p->aux[k] && i < (size_t)s->count; i++)
            for (size_t c = 0; c < 3; c++)
                p->aux[k][3 * (at + i) + c] = (float)s->value[LULL_PLANE_ALBEDO + k][i][c];
}

/* --- denoising --------------------------------------------------------------------------------------------------------- */

/* Denoises color[0 … count). */
static int32_t run(struct picture *p, int count, struct lull_error *err)
{
    const struct lull_host_denoising *how = p->how;
    struct base_err why = {0};
    const struct lull_oidn_pictures pictures = {.color = {p->color[0], count > 1 ? p->color[1] : NULL},
                                                .albedo = p->aux[0],
                                                .normal = p->aux[1],
                                                .out = {p->clean[0], count > 1 ? p->clean[1] : NULL}};
    return lull_oidn_run(p->oidn, &pictures, how->cancelled, how->context, &why) ? lull_host_translate(&why, err) : LULL_OK;
}

/* Luminance as a display shows it, 1 is its white. */
static float shown(const struct picture *p, const float *rgb)
{
    double y = 0.0;
    for (int c = 0; c < 3; c++)
        y += p->luminance[c] * (double)rgb[c];
    y *= p->exposure;
    return (float)(y > 0.0 ? fmin(y, 1.0) : 0.0);
}

static void estimate(struct picture *p, const struct lull_kit_span *s, size_t at)
{
    float light[4][LULL_KIT_SPAN_MAX];
    const struct lull_estimate part = {p->error.denoised + at, p->error.agreed + at, p->error.noisy + at};
    if (!has_halves(s->block))
        return;
    for (size_t i = 0; i < (size_t)s->count; i++)
        for (int k = 0; k < 2; k++) {
            light[k][i] = shown(p, p->color[k] + 3 * (at + i));
            light[2 + k][i] = shown(p, p->clean[k] + 3 * (at + i));
        }
    const struct lull_estimate_in in = {light[0], light[1], light[2], light[3],
                                        (double)s->block->half_spp / (double)s->block->spp};
    lull_estimate_pixels(&in, (size_t)s->count, &part);
}

/* How much of the noisy picture each pixel takes; the denoised halves lose their specks. weight: [n]; scratch: [2][n]. */
static int32_t weigh(struct picture *p, float *weight, float *scratch, struct lull_error *err)
{
    float **const maps[] = {&p->error.denoised, &p->error.agreed, &p->error.noisy};
    for (int i = 0; i < 3; i++)
        if (!(*maps[i] = calloc(p->pixels, sizeof(float))))
            return no_memory(err);
    each_span(p, LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF), read_halves);
    int32_t code = run(p, 2, err);
    if (code != LULL_OK)
        return code;
    each_span(p, LULL_PLANE_BIT(LULL_PLANE_COLOR), estimate);
    lull_blend_weights(&p->error, p->width, p->height, scratch, weight, scratch + p->pixels);
    lull_blend_despeckle(scratch + p->pixels, p->pixels, p->clean[0], p->clean[1]);
    return LULL_OK;
}

static int32_t prepare(struct picture *p, struct lull_error *err)
{
    const struct lull_host_denoising *how = p->how;
    struct base_err why = {0};
    const struct lull_oidn_form form = {.width = p->width,
                                        .height = p->height,
                                        .albedo = p->albedo,
                                        .normal = p->normal,
                                        .quality = LULL_OIDN_HIGH,
                                        .threads = (int32_t)how->threads,
                                        .margin = LULL_OIDN_MARGIN,
                                        .exposure = (float)p->exposure};
    if (lull_oidn_open(how->library, &p->oidn, &why) || lull_oidn_prepare(p->oidn, &form, &why))
        return lull_host_translate(&why, err);
    for (int k = 0; k < 2; k++) {
        if (k ? p->normal : p->albedo)
            p->aux[k] = picture_alloc(p);
        p->color[k] = picture_alloc(p);
        p->clean[k] = picture_alloc(p);
        if (((k ? p->normal : p->albedo) && !p->aux[k]) || !p->color[k] || !p->clean[k])
            return no_memory(err);
    }
    each_span(p, LULL_PLANE_BIT(LULL_PLANE_ALBEDO) | LULL_PLANE_BIT(LULL_PLANE_NORMAL), read_auxiliary);
    return LULL_OK;
}

/* The denoiser also paints where there are no samples yet. */
static void black_out(const struct picture *p, float *rgb)
{
    const struct lull_host_blocks *blocks = &p->frame->blocks;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        for (int32_t y = b->y0; b->spp == 0 && y < b->y1; y++)
            memset(rgb + 3 * ((size_t)(y - p->view.y0) * (size_t)p->width + (size_t)(b->x0 - p->view.x0)), 0,
                   3 * (size_t)(b->x1 - b->x0) * sizeof *rgb);
    }
}

static int32_t make(struct picture *p, const struct lull_host_picture *out, struct lull_error *err)
{
    const int full = (p->how->flags & LULL_DENOISE_FULL) != 0;
    float *weight = calloc(3 * p->pixels, sizeof(float));
    int32_t code = weight ? prepare(p, err) : no_memory(err);
    if (code == LULL_OK && !full)
        code = weigh(p, weight, weight + p->pixels, err);
    if (code == LULL_OK) {
        each_span(p, LULL_PLANE_BIT(LULL_PLANE_COLOR), read_mean);
        code = full ? run(p, 1, err) : LULL_OK;
    }
    if (code == LULL_OK) {
        for (size_t i = 0; !full && i < 3 * p->pixels; i++)
            p->clean[0][i] = 0.5f * p->clean[0][i] + 0.5f * p->clean[1][i];
        black_out(p, p->clean[0]);
        lull_blend(p->color[0], p->clean[0], weight, p->pixels, out->rgb);
        if (out->denoised)
            memcpy(out->denoised, p->clean[0], 3 * p->pixels * sizeof(float));
        if (out->weight)
            memcpy(out->weight, weight, p->pixels * sizeof(float));
    }
    free(weight);
    return code;
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
    struct picture p = {.frame = frame,
                        .how = how,
                        .view = lull_host_seen(view, &s),
                        .width = view->x1 - view->x0,
                        .height = view->y1 - view->y0,
                        .exposure = frame->config.exposure > 0.0 ? frame->config.exposure : 1.0,
                        .albedo = s.planes[LULL_PLANE_ALBEDO].data != NULL};
    p.normal = p.albedo && s.planes[LULL_PLANE_NORMAL].data;
    p.pixels = (size_t)p.width * (size_t)p.height;
    lull_host_luminance(frame, p.luminance);
    if (!s.planes[LULL_PLANE_COLOR].data || (!(how->flags & LULL_DENOISE_FULL) && !s.planes[LULL_PLANE_HALF].data))
        code = lull_error_set(err, LULL_E_INVALID, "a denoised picture needs the plane COLOR, a blend HALF besides");
    else
        code = make(&p, out, err);
    picture_release(&p);
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
