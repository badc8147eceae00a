#include "eval/network.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/fio.h"
#include "data/image.h"
#include "eval/plot.h"
#include "nn/loss.h"

/* Recorded levels are whole numbers: a step may be a little short of the spacing. */
static const double spacing_slack = 0.97;

struct run {
    const struct ggn_eval_set *set;
    const struct ggn_model *model;
    struct ggn_method *method;
    struct ggn_infer **infer; /* [workers] */
    void **history;           /* [workers] */
};

static int check_size(const struct ggn_model *model, const struct ggn_chains *c, struct ggn_err *err)
{
    if (c->width != model->hyper.width || c->height != model->hyper.height)
        return ggn_fail(err, GGN_EINVAL, "the blocks are %dx%d, the model judges %dx%d", c->width, c->height, model->hyper.width, model->hyper.height);
    return GGN_OK;
}

static int judge_block(void *data, int index, int worker, struct ggn_err *err)
{
    struct run *r = data;
    const struct ggn_eval_block *b = &r->set->blocks[index];
    const struct ggn_chain *c = &r->set->chains.chains[b->chain];
    size_t values = ggn_chains_values(&r->set->chains);
    void *history = r->history[worker];
    double last = 0.0;
    int rc = GGN_OK;
    ggn_history_clear(history);
    for (int i = 0; i < c->n_levels && rc == GGN_OK; i++) {
        size_t at = b->first + (size_t)i - (size_t)(r->set->window - 1);
        double p_noisy;
        if (last > 0.0 && c->spp[i] < spacing_slack * r->model->calibration.spacing * last)
            continue;
        last = c->spp[i];
        ggn_infer_push(r->infer[worker], history, c->noisy + values * (size_t)i, (uint64_t)c->spp[i]);
        if (i < r->set->window - 1 || ggn_history_count(history) < r->model->hyper.window)
            continue;
        rc = ggn_infer_decide(r->infer[worker], history, &p_noisy, NULL);
        r->method->score[at] = p_noisy;
    }
    return rc == GGN_OK ? rc : ggn_fail(err, rc, "block %u: the model gives no decision", b->label.id);
}

int ggn_eval_network(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model, const char *name,
                     enum ggn_precision precision, struct ggn_threads *threads, struct ggn_err *err)
{
    int workers = ggn_threads_count(threads);
    double *nothing = malloc(s->n * sizeof *nothing);
    struct run r = {s, model, m, calloc((size_t)workers, sizeof *r.infer), calloc((size_t)workers, sizeof *r.history)};
    int rc = nothing == NULL || r.infer == NULL || r.history == NULL ? ggn_fail_nomem(err, name) : check_size(model, &s->chains, err);
    for (size_t i = 0; i < s->n && rc == GGN_OK; i++)
        nothing[i] = (double)NAN;
    if (rc == GGN_OK)
        rc = ggn_method_scores(m, s, name, nothing, err);
    free(nothing);
    for (int i = 0; i < workers && rc == GGN_OK; i++) {
        r.infer[i] = ggn_infer_create(model, precision, NULL, err);
        r.history[i] = r.infer[i] != NULL ? malloc(ggn_history_bytes(&model->hyper)) : NULL;
        if (r.infer[i] == NULL)
            rc = err->code != GGN_OK ? err->code : GGN_ENOMEM;
        else if (r.history[i] == NULL)
            rc = ggn_fail_nomem(err, name);
    }
    if (rc == GGN_OK) {
        m->cut = model->calibration.threshold;
        m->passes = model->calibration.consecutive > 0 ? model->calibration.consecutive : 1;
        rc = ggn_eval_each_block(s, threads, judge_block, &r, err);
    }
    for (int i = 0; i < workers && r.infer != NULL && r.history != NULL; i++) {
        ggn_infer_destroy(r.infer[i]);
        free(r.history[i]);
    }
    free(r.infer);
    free(r.history);
    if (rc == GGN_OK)
        ggn_method_run(m, s);
    else if (m->stop != NULL)
        ggn_method_release(m);
    return rc;
}

/* --- denoiser before and after --- */

struct strip {
    char file[4128]; /* three pictures side by side; removed at the end */
    char title[256];
};

static int make_strip(const struct ggn_eval_set *s, int index, struct ggn_infer *infer, const char *path, int number, struct strip *strip,
                      struct ggn_err *err)
{
    const struct ggn_eval_block *b = &s->blocks[index];
    const struct ggn_chain *chain = &s->chains.chains[b->chain];
    size_t w = (size_t)s->chains.width, h = (size_t)s->chains.height, pixels = w * h;
    uint8_t *rgb = malloc(9 * pixels);
    float *planes = malloc(9 * pixels * sizeof *planes);
    struct ggn_ssim_f32 *ssim = ggn_ssim_create_f32((int)h, (int)w, NULL, err);
    int rc = rgb == NULL || planes == NULL || ssim == NULL ? ggn_fail_nomem(err, path) : GGN_OK;
    if (rc == GGN_OK) {
        float *part[3] = {planes, planes + 3 * pixels, planes + 6 * pixels};
        const float *x[3][3];
        for (size_t i = 0; i < 3 * pixels; i++) {
            part[0][i] = (float)chain->noisy[i] / 255.0f;
            part[2][i] = (float)chain->reference[i] / 255.0f;
        }
        ggn_infer_denoise(infer, chain->noisy, part[1]);
        for (size_t k = 0; k < 3; k++)
            for (size_t c = 0; c < 3; c++) {
                x[k][c] = part[k] + c * pixels;
                for (size_t i = 0; i < pixels; i++)
                    rgb[3 * ((i / w) * 3 * w + k * w + i % w) + c] = (uint8_t)(255.0f * part[k][c * pixels + i] + 0.5f);
            }
        double before = ggn_ssim_mean_f32(ssim, x[0], x[2], NULL, 3, (int)w, 0.0), after = ggn_ssim_mean_f32(ssim, x[1], x[2], NULL, 3, (int)w, 0.0);
        snprintf(strip->title, sizeof strip->title, "%.80s block %u at %.0f spp: SSIM %.3f  denoised %.3f  reference",
                 s->chains.data.views[b->view].name, b->label.id, chain->spp[0], before, after);
        snprintf(strip->file, sizeof strip->file, "%.4000s.part%d.png", path, number);
        rc = ggn_image8_write_png(strip->file, rgb, (int)(3 * w), (int)h, err);
    }
    ggn_ssim_destroy_f32(ssim);
    free(planes);
    free(rgb);
    return rc;
}

int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split, struct ggn_err *err)
{
    enum { MOST = 4 };
    struct strip strips[MOST];
    struct ggn_plot plot;
    int n = 0, rc = GGN_OK, last_view = -1;
    struct ggn_infer *infer = ggn_infer_create(model, GGN_PRECISION_F32, NULL, err);
    if (infer == NULL)
        return err->code;
    for (int pass = 0; pass < 2; pass++) /* first one block of each view */
        for (int b = 0; b < s->n_blocks && n < MOST && rc == GGN_OK; b++) {
            if (s->blocks[b].split != split || (s->blocks[b].view == last_view) == (pass == 0) ||
                s->chains.chains[s->blocks[b].chain].reference == NULL)
                continue;
            last_view = s->blocks[b].view;
            rc = make_strip(s, b, infer, path, n, &strips[n], err);
            n += rc == GGN_OK;
        }
    ggn_infer_destroy(infer);
    if (rc == GGN_OK && n > 0)
        rc = ggn_plot_begin(&plot, path, 960, 360 * n + 20, err);
    if (rc == GGN_OK && n > 0) {
        fprintf(plot.script, "unset tics\nunset border\nset size ratio -1\nset yrange [] reverse\nset multiplot layout %d,1\n", n);
        for (int i = 0; i < n; i++) {
            fputs("set title ", plot.script);
            ggn_plot_quote(plot.script, strips[i].title);
            fputs("\nplot ", plot.script);
            ggn_plot_quote(plot.script, strips[i].file);
            fputs(" binary filetype=png with rgbimage notitle\n", plot.script);
        }
        fputs("unset multiplot\n", plot.script);
        rc = ggn_plot_end(&plot, 1, err);
    }
    for (int i = 0; i < n; i++)
        unlink(strips[i].file);
    return rc;
}
