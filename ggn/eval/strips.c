/* Strips of equal tiles, one under the other, pixel for pixel. */
#include "eval/strips.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/json.h"
#include "eval/viewer.h"
#include "model/policy.h"
#include "nn/ssim.h"
#include "picture/colour_map.h"
#include "picture/png.h"

enum { STRIPS = 4 };
struct strips {
    int n, tiles, width, height; /* of a strip: tiles, pixels of one */
    uint8_t *rgb;                /* owns; [STRIPS][height][tiles * width][3] */
    char title[STRIPS][256];
};

static int begin_strips(struct strips *out, const struct ggn_eval_set *s, int tiles, struct base_err *err)
{
    *out = (struct strips){.tiles = tiles, .width = s->images.width, .height = s->images.height};
    out->rgb = malloc((size_t)STRIPS * (size_t)tiles * ggn_series_set_values(&s->images));
    return out->rgb ? 0 : base_fail_nomem(err, "strips");
}

/* Room for one more, of title out->title[out->n - 1]. */
static uint8_t *next_strip(struct strips *s)
{
    return s->rgb + (size_t)s->n++ * 3 * (size_t)s->tiles * (size_t)s->width * (size_t)s->height;
}

/* Writes them if rc says so, and says in `to` what they are called. */
static int finish_strips(struct strips *s, const char *path, cJSON *to, int *failed, int rc, struct base_err *err)
{
    if (!rc && s->n > 0)
        rc = pic_write_png(path, s->tiles * s->width, s->n * s->height, 3, s->rgb, err);
    cJSON *titles = !rc && s->n > 0 ? base_json_array(to, base_file_name(path), failed) : NULL;
    for (int i = 0; i < s->n && titles; i++)
        base_json_text(titles, NULL, s->title[i], failed);
    free(s->rgb);
    return rc;
}

/* Puts a planar float image in 0..1 into tile k of a strip of `tiles`. */
static void put_tile(uint8_t *strip, int tiles, int k, const float *planes, size_t w, size_t h)
{
    size_t pixels = w * h;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            float v = fminf(fmaxf(planes[c * pixels + i], 0.0f), 1.0f);
            strip[3 * (i / w * (size_t)tiles * w + (size_t)k * w + i % w) + c] = (uint8_t)(255.0f * v + 0.5f);
        }
}

static double ssim_of(struct ggn_ssim *ssim, const float *a, const float *b, size_t pixels, int width)
{
    const float *x[3] = {a, a + pixels, a + 2 * pixels}, *y[3] = {b, b + pixels, b + 2 * pixels};
    return ggn_ssim_mean(ssim, x, y, NULL, 3, width, 0.0);
}

static int denoiser_strip(const struct ggn_eval_set *s, const struct ggn_eval_block *b, struct ggn_viewer *v,
                          struct strips *strips, struct base_err *err)
{
    const struct ggn_level_series *c = &s->images.series[b->series];
    int w = s->images.width, h = s->images.height;
    size_t pixels = (size_t)w * (size_t)h, values = 3 * pixels;
    float *planes = malloc(3 * values * sizeof *planes);
    struct ggn_ssim *ssim = ggn_ssim_create(h, w, NULL, err);
    int rc = !planes || !ssim ? base_fail_nomem(err, "strips") : 0;
    if (!rc) {
        uint8_t *strip = next_strip(strips);
        ggn_viewer_turn(v, c);
        const uint16_t *denoised = ggn_viewer_denoise(v, 0);
        for (size_t i = 0; i < values; i++) {
            planes[i] = (float)c->noisy[i] / 255.0f;
            planes[values + i] = (float)denoised[i] / 65535.0f;
            planes[2 * values + i] = (float)c->reference[i] / 255.0f;
        }
        for (int k = 0; k < 3; k++)
            put_tile(strip, 3, k, planes + (size_t)k * values, (size_t)w, (size_t)h);
        snprintf(strips->title[strips->n - 1], sizeof strips->title[0],
                 "%.80s block %u at %.0f spp: SSIM %.3f     denoised: SSIM %.3f     reference",
                 s->images.data.views[b->view].name, b->label.id, c->spp[0],
                 ssim_of(ssim, planes, planes + 2 * values, pixels, w),
                 ssim_of(ssim, planes + values, planes + 2 * values, pixels, w));
    }
    ggn_ssim_destroy(ssim);
    free(planes);
    return rc;
}

int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model,
                              enum ggn_split split, struct cJSON *titles, int *failed, struct base_err *err)
{
    struct strips strips;
    struct ggn_viewer v;
    int last_view = -1, rc = ggn_viewer_init(&v, model, GGN_PRECISION_F32, &s->images, err);
    if (rc)
        return rc;
    rc = begin_strips(&strips, s, 3, err);
    for (int b = 0; b < s->n_blocks && strips.n < STRIPS && !rc; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split || block->view == last_view || !s->images.series[block->series].reference)
            continue;
        last_view = block->view;
        rc = denoiser_strip(s, block, &v, &strips, err);
    }
    ggn_viewer_release(&v);
    return finish_strips(&strips, path, titles, failed, rc, err);
}

/* Grey tile of a feature map, or of the difference of two (black 0), stretched to what it spans. */
static void put_map(uint8_t *strip, int tiles, int k, const float *a, const float *b, size_t w, size_t h)
{
    float lo = INFINITY, hi = -INFINITY;
    for (size_t i = 0; i < w * h; i++) {
        float v = b ? fabsf(a[i] - b[i]) : a[i];
        lo = fminf(lo, v);
        hi = fmaxf(hi, v);
    }
    for (size_t i = 0; i < w * h; i++) {
        float v = b ? fabsf(a[i] - b[i]) : a[i];
        uint8_t *at = strip + 3 * (i / w * (size_t)tiles * w + (size_t)k * w + i % w);
        pic_colour(b ? PIC_MAGMA : PIC_VIRIDIS, hi > lo ? (double)((v - lo) / (hi - lo)) : 0.0, at);
    }
}

/* The window that ends at `level` of a block, as a strip. */
static int feature_strip(const struct ggn_eval_set *s, const struct ggn_eval_block *b, int level,
                         const struct ggn_policy *policy, struct ggn_viewer *v, struct strips *strips, struct base_err *err)
{
    const struct ggn_level_series *c = &s->images.series[b->series];
    int w = s->images.width, h = s->images.height, row;
    size_t pixels = (size_t)w * (size_t)h, values = 3 * pixels;
    float *planes = malloc((values + 2 * pixels) * sizeof *planes);
    int rc = !planes ? base_fail_nomem(err, "strips") : 0;
    if (!rc) {
        uint8_t *strip = next_strip(strips);
        int levels[GGN_WINDOW_MAX];
        for (int i = 0; i < v->window; i++)
            levels[i] = level - v->window + 1 + i;
        ggn_viewer_turn(v, c);
        double p = ggn_policy_p(policy, ggn_viewer_logit(v, levels));
        for (size_t i = 0; i < values; i++)
            planes[i] = (float)c->noisy[values * (size_t)level + i] / 255.0f;
        for (int which = 0; which < 2; which++) {
            const float *map = ggn_inference_feature_map(v->inference, which, &row);
            for (int y = 0; y < h; y++)
                memcpy(planes + values + (size_t)which * pixels + (size_t)y * (size_t)w, map + (size_t)y * (size_t)row,
                       (size_t)w * sizeof *map);
        }
        put_tile(strip, 4, 0, planes, (size_t)w, (size_t)h);
        put_map(strip, 4, 1, planes + values, NULL, (size_t)w, (size_t)h);
        put_map(strip, 4, 2, planes + values + pixels, NULL, (size_t)w, (size_t)h);
        put_map(strip, 4, 3, planes + values, planes + values + pixels, (size_t)w, (size_t)h);
        snprintf(strips->title[strips->n - 1], sizeof strips->title[0],
                 "%.60s block %u, threshold %.0f: %.0f spp, p(noisy) %.3f   NFM of denoised   NFM of noisy   difference",
                 s->images.data.views[b->view].name, b->label.id, b->label.threshold, c->spp[level], p);
    }
    free(planes);
    return rc;
}

int ggn_eval_feature_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model,
                             enum ggn_split split, struct cJSON *titles, int *failed, struct base_err *err)
{
    struct strips strips;
    struct ggn_policy policy;
    struct ggn_viewer v;
    const struct ggn_eval_block *block = NULL;
    /* Tiles would not fit together into one map. */
    if (s->images.width != model->hyper.width || s->images.height != model->hyper.height)
        return 0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_level_series *c = &s->images.series[s->blocks[b].series];
        if (s->blocks[b].split != split || c->n_levels < model->hyper.window)
            continue;
        /* one whose threshold lies well inside what was recorded, if there is one */
        int inside = s->blocks[b].label.threshold > 1.5 * c->spp[model->hyper.window - 1] && !s->blocks[b].label.censored;
        block = !block || inside ? &s->blocks[b] : block;
        if (inside)
            break;
    }
    int rc = ggn_policy_of(model, &policy, err);
    if (!rc)
        rc = ggn_viewer_init(&v, model, GGN_PRECISION_F32, &s->images, err);
    if (rc || !block) {
        if (!rc)
            ggn_viewer_release(&v);
        return rc;
    }
    const struct ggn_level_series *c = &s->images.series[block->series];
    int at[3] = {model->hyper.window - 1, model->hyper.window - 1, c->n_levels - 1};
    while (at[1] + 1 < c->n_levels && c->spp[at[1]] < block->label.threshold)
        at[1]++;
    rc = begin_strips(&strips, s, 4, err);
    for (int k = 0; k < 3 && !rc; k++)
        rc = feature_strip(s, block, at[k], &policy, &v, &strips, err);
    ggn_viewer_release(&v);
    return finish_strips(&strips, path, titles, failed, rc, err);
}
