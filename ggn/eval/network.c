#include "eval/network.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "data/image.h"
#include "figures/plot.h"
#include "model/judge.h"
#include "model/policy.h"
#include "model/window.h"
#include "nn/ssim.h"

/* Recorded levels are rounded, unevenly so when they are low: a step may be short of the policy's by this share (in octaves). */
static const double spacing_slack = 0.75;
enum { WINDOW_MAX = 16 };

/* One worker's judge and the window it holds, oldest first. */
struct viewer {
    struct ggn_judge *judge;
    uint16_t *room; /* owns; [window][3][P] denoised images, reused in turn */
    const uint8_t *noisy[WINDOW_MAX];
    uint16_t *denoised[WINDOW_MAX];
    double spp[WINDOW_MAX];
    int n, window;
};

static void viewer_release(struct viewer *v)
{
    ggn_judge_destroy(v->judge);
    free(v->room);
    *v = (struct viewer){0};
}

static int viewer_init(struct viewer *v, const struct ggn_model *model, enum ggn_precision precision, size_t values, struct base_err *err)
{
    *v = (struct viewer){.window = model->hyper.window};
    if (v->window > WINDOW_MAX)
        return base_fail(err, BASE_EINVAL, "the model looks at windows of %d images, more than %d", v->window, WINDOW_MAX);
    v->judge = ggn_judge_create(model, precision, NULL, err);
    if (!v->judge)
        return err->code;
    v->room = malloc((size_t)v->window * values * sizeof *v->room);
    if (!v->room) {
        viewer_release(v);
        return base_fail_nomem(err, "evaluation");
    }
    for (int i = 0; i < v->window; i++)
        v->denoised[i] = v->room + (size_t)i * values;
    return 0;
}

/* Appends a level, dropping the oldest when the window is full. */
static void viewer_push(struct viewer *v, const uint8_t *noisy, double spp, int w, int h)
{
    if (v->n == v->window) {
        uint16_t *oldest = v->denoised[0];
        memmove(v->noisy, v->noisy + 1, sizeof *v->noisy * (size_t)(v->window - 1));
        memmove(v->denoised, v->denoised + 1, sizeof *v->denoised * (size_t)(v->window - 1));
        memmove(v->spp, v->spp + 1, sizeof *v->spp * (size_t)(v->window - 1));
        v->denoised[v->window - 1] = oldest;
        v->n--;
    }
    v->noisy[v->n] = noisy;
    v->spp[v->n] = spp;
    ggn_judge_denoise(v->judge, noisy, v->denoised[v->n], w, h);
    v->n++;
}

static double viewer_logit(struct viewer *v, int w, int h)
{
    const uint16_t *denoised[WINDOW_MAX];
    for (int i = 0; i < v->window; i++)
        denoised[i] = v->denoised[i];
    return ggn_judge_logit(v->judge, v->noisy, denoised, w, h);
}

/* Whether the criterion would look at a level, after one at `last` (0: none yet). */
static int is_looked_at(const struct ggn_policy *p, double spp, double last)
{
    if (last <= 0.0)
        return spp >= 0.97 * p->first_spp;
    return spp >= last * pow(p->ratio > 1.001 ? p->ratio : (last + p->step_spp) / last, spacing_slack);
}

struct run {
    const struct ggn_eval_set *set;
    struct ggn_policy policy;
    struct ggn_method *method;
    struct viewer *viewers; /* [workers] */
};

/* The tail guard at level i: its statistics where they were recorded, else scaled from the last level that has them. */
static int tail_holds(const struct ggn_policy *p, const struct ggn_chain *c, int i)
{
    int k = i;
    while (k > 0 && (!c->tail999 || isnan(c->tail999[k])))
        k--;
    if (!c->tail999 || isnan(c->tail999[k]))
        return 0;
    return ggn_policy_tail_holds(p, c->tail999[k] * sqrt(c->spp[k] / c->spp[i]), c->gini[k]);
}

static int judge_block(void *data, int index, int worker, struct base_err *err)
{
    struct run *r = data;
    const struct ggn_eval_block *b = &r->set->blocks[index];
    const struct ggn_chain *c = &r->set->chains.chains[b->chain];
    int w = r->set->chains.width, h = r->set->chains.height;
    size_t values = ggn_chains_values(&r->set->chains);
    struct viewer *v = &r->viewers[worker];
    double last = 0.0;
    (void)err;
    v->n = 0;
    for (int i = 0; i < c->n_levels; i++) {
        if (!is_looked_at(&r->policy, c->spp[i], last))
            continue;
        last = c->spp[i];
        viewer_push(v, c->noisy + values * (size_t)i, last, w, h);
        if (v->n < v->window || i < r->set->window - 1)
            continue;
        size_t at = b->first + (size_t)i - (size_t)(r->set->window - 1);
        double noise = ggn_window_noise(v->noisy[0], v->noisy[v->window - 1], values, v->spp[0], last);
        r->method->score[at] = ggn_policy_p(&r->policy, viewer_logit(v, w, h));
        r->method->own_guard[at] = (r->policy.gate_noise > 0.0 && noise > r->policy.gate_noise) || tail_holds(&r->policy, c, i);
    }
    return 0;
}

static int init_method(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, const struct ggn_policy *p, struct base_err *err)
{
    double *nothing = malloc((s->n > 0 ? s->n : 1) * sizeof *nothing);
    int rc = !nothing ? base_fail_nomem(err, name) : 0;
    for (size_t i = 0; i < s->n && !rc; i++)
        nothing[i] = (double)NAN;
    if (!rc)
        rc = ggn_method_scores(m, s, name, nothing, err);
    free(nothing);
    if (rc)
        return rc;
    m->own_guard = calloc(s->n > 0 ? s->n : 1, sizeof *m->own_guard);
    if (!m->own_guard) {
        ggn_method_release(m);
        return base_fail_nomem(err, name);
    }
    m->guard = m->own_guard;
    m->cut = p->threshold;
    m->passes = p->passes > 0 ? p->passes : 1;
    return 0;
}

int ggn_eval_network(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model, const char *name,
                     enum ggn_precision precision, struct base_threads *threads, struct base_err *err)
{
    int workers = base_threads_count(threads), made = 0;
    struct run r = {.set = s, .method = m, .viewers = calloc((size_t)workers, sizeof *r.viewers)};
    int rc = !r.viewers ? base_fail_nomem(err, name) : ggn_policy_of(model, &r.policy, err);
    if (!rc)
        rc = init_method(m, s, name, &r.policy, err);
    if (rc) {
        free(r.viewers);
        return rc;
    }
    for (; made < workers && !rc; made += !rc)
        rc = viewer_init(&r.viewers[made], model, precision, ggn_chains_values(&s->chains), err);
    if (!rc)
        rc = ggn_eval_each_block(s, threads, judge_block, &r, err);
    for (int i = 0; i < made; i++)
        viewer_release(&r.viewers[i]);
    free(r.viewers);
    if (!rc)
        ggn_method_run(m, s);
    else
        ggn_method_release(m);
    return rc;
}

/* --- pictures: strips of equal tiles, one under the other --- */

enum { STRIPS = 4 };
struct strips {
    int n;
    char file[STRIPS][4128]; /* removed at the end */
    char title[STRIPS][256];
};

static int add_strip(struct strips *s, const char *path, const uint8_t *rgb, int w, int h, struct base_err *err)
{
    snprintf(s->file[s->n], sizeof s->file[0], "%.4000s.part%d.png", path, s->n);
    int rc = ggn_image8_write_png(s->file[s->n], rgb, w, h, err);
    s->n += !rc;
    return rc;
}

/* Draws the strips if rc says so; removes their files. */
static int finish_strips(struct strips *s, const char *path, int width, int height_each, int rc, struct base_err *err)
{
    struct ggn_plot plot;
    if (!rc && s->n > 0)
        rc = ggn_plot_begin(&plot, path, width, height_each * s->n + 20, err);
    if (!rc && s->n > 0) {
        fprintf(plot.script, "unset tics\nunset border\nset size ratio -1\nset yrange [] reverse\nset multiplot layout %d,1\n", s->n);
        for (int i = 0; i < s->n; i++) {
            fputs("set title ", plot.script);
            ggn_plot_quote(plot.script, s->title[i]);
            fputs("\nplot ", plot.script);
            ggn_plot_quote(plot.script, s->file[i]);
            fputs(" binary filetype=png with rgbimage notitle\n", plot.script);
        }
        fputs("unset multiplot\n", plot.script);
        rc = ggn_plot_end(&plot, 1, err);
    }
    for (int i = 0; i < s->n; i++)
        unlink(s->file[i]);
    return rc;
}

/* Puts a planar float image in 0..1 into tile k of a strip of `tiles`. */
static void put_tile(uint8_t *strip, int tiles, int k, const float *planes, size_t w, size_t h)
{
    size_t pixels = w * h;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            float v = planes[c * pixels + i];
            strip[3 * (i / w * (size_t)tiles * w + (size_t)k * w + i % w) + c] = (uint8_t)(255.0f * (v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f) + 0.5f);
        }
}

static double ssim_of(struct ggn_ssim *ssim, const float *a, const float *b, size_t pixels, int width)
{
    const float *x[3] = {a, a + pixels, a + 2 * pixels}, *y[3] = {b, b + pixels, b + 2 * pixels};
    return ggn_ssim_mean(ssim, x, y, NULL, 3, width, 0.0);
}

static int denoiser_strip(const struct ggn_eval_set *s, const struct ggn_eval_block *b, struct viewer *v, const char *path, struct strips *strips,
                          struct base_err *err)
{
    const struct ggn_chain *c = &s->chains.chains[b->chain];
    int w = s->chains.width, h = s->chains.height;
    size_t pixels = (size_t)w * (size_t)h, values = 3 * pixels;
    uint8_t *strip = malloc(3 * values);
    float *planes = malloc(3 * values * sizeof *planes);
    struct ggn_ssim *ssim = ggn_ssim_create(h, w, NULL, err);
    int rc = !strip || !planes || !ssim ? base_fail_nomem(err, path) : 0;
    if (!rc) {
        v->n = 0;
        viewer_push(v, c->noisy, c->spp[0], w, h);
        for (size_t i = 0; i < values; i++) {
            planes[i] = (float)c->noisy[i] / 255.0f;
            planes[values + i] = (float)v->denoised[0][i] / 65535.0f;
            planes[2 * values + i] = (float)c->reference[i] / 255.0f;
        }
        for (int k = 0; k < 3; k++)
            put_tile(strip, 3, k, planes + (size_t)k * values, (size_t)w, (size_t)h);
        snprintf(strips->title[strips->n], sizeof strips->title[0], "%.80s block %u at %.0f spp: SSIM %.3f     denoised: SSIM %.3f     reference",
                 s->chains.data.views[b->view].name, b->label.id, c->spp[0], ssim_of(ssim, planes, planes + 2 * values, pixels, w),
                 ssim_of(ssim, planes + values, planes + 2 * values, pixels, w));
        rc = add_strip(strips, path, strip, 3 * w, h, err);
    }
    ggn_ssim_destroy(ssim);
    free(planes);
    free(strip);
    return rc;
}

int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split, struct base_err *err)
{
    struct strips strips = {0};
    struct viewer v;
    int last_view = -1, rc = viewer_init(&v, model, GGN_PRECISION_F32, ggn_chains_values(&s->chains), err);
    if (rc)
        return rc;
    for (int b = 0; b < s->n_blocks && strips.n < STRIPS && !rc; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->split != split || block->view == last_view || !s->chains.chains[block->chain].reference)
            continue;
        last_view = block->view;
        rc = denoiser_strip(s, block, &v, path, &strips, err);
    }
    viewer_release(&v);
    return finish_strips(&strips, path, 960, 360, rc, err);
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
        ggn_colormap_rgb(b ? GGN_MAGMA : GGN_VIRIDIS, hi > lo ? (double)((v - lo) / (hi - lo)) : 0.0, at);
    }
}

/* The window that ends at `level` of a block, as a strip. */
static int feature_strip(const struct ggn_eval_set *s, const struct ggn_eval_block *b, int level, const struct ggn_policy *policy, struct viewer *v,
                         const char *path, struct strips *strips, struct base_err *err)
{
    const struct ggn_chain *c = &s->chains.chains[b->chain];
    int w = s->chains.width, h = s->chains.height, row;
    size_t pixels = (size_t)w * (size_t)h, values = 3 * pixels;
    uint8_t *strip = malloc(4 * values);
    float *planes = malloc((values + 2 * pixels) * sizeof *planes);
    int rc = !strip || !planes ? base_fail_nomem(err, path) : 0;
    if (!rc) {
        v->n = 0;
        for (int i = level - v->window + 1; i <= level; i++)
            viewer_push(v, c->noisy + values * (size_t)i, c->spp[i], w, h);
        double p = ggn_policy_p(policy, viewer_logit(v, w, h));
        for (size_t i = 0; i < values; i++)
            planes[i] = (float)c->noisy[values * (size_t)level + i] / 255.0f;
        for (int which = 0; which < 2; which++) {
            const float *map = ggn_judge_feature_map(v->judge, which, &row);
            for (int y = 0; y < h; y++)
                memcpy(planes + values + (size_t)which * pixels + (size_t)y * (size_t)w, map + (size_t)y * (size_t)row, (size_t)w * sizeof *map);
        }
        put_tile(strip, 4, 0, planes, (size_t)w, (size_t)h);
        put_map(strip, 4, 1, planes + values, NULL, (size_t)w, (size_t)h);
        put_map(strip, 4, 2, planes + values + pixels, NULL, (size_t)w, (size_t)h);
        put_map(strip, 4, 3, planes + values, planes + values + pixels, (size_t)w, (size_t)h);
        snprintf(strips->title[strips->n], sizeof strips->title[0], "%.60s block %u, threshold %.0f: %.0f spp, p(noisy) %.3f   NFM of denoised   NFM of noisy   difference",
                 s->chains.data.views[b->view].name, b->label.id, b->label.threshold, c->spp[level], p);
        rc = add_strip(strips, path, strip, 4 * w, h, err);
    }
    free(planes);
    free(strip);
    return rc;
}

int ggn_eval_feature_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split, struct base_err *err)
{
    struct strips strips = {0};
    struct ggn_policy policy;
    struct viewer v;
    const struct ggn_eval_block *block = NULL;
    /* Tiles would not fit together into one map. */
    if (s->chains.width != model->hyper.width || s->chains.height != model->hyper.height)
        return 0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_chain *c = &s->chains.chains[s->blocks[b].chain];
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
        rc = viewer_init(&v, model, GGN_PRECISION_F32, ggn_chains_values(&s->chains), err);
    if (rc || !block) {
        if (!rc)
            viewer_release(&v);
        return rc;
    }
    const struct ggn_chain *c = &s->chains.chains[block->chain];
    int at[3] = {model->hyper.window - 1, model->hyper.window - 1, c->n_levels - 1};
    while (at[1] + 1 < c->n_levels && c->spp[at[1]] < block->label.threshold)
        at[1]++;
    for (int k = 0; k < 3 && !rc; k++)
        rc = feature_strip(s, block, at[k], &policy, &v, path, &strips, err);
    viewer_release(&v);
    return finish_strips(&strips, path, 1100, 320, rc, err);
}
