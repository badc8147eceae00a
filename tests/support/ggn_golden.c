#include "support/ggn_golden.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/hash.h"
#include "nn/loss.h"
#include "nn/ssim.h"
#include "nn/real.h"

#ifdef GGN_DOUBLE
#define ggn_golden_run GGN_TYPED(ggn_golden_run)
#endif

enum { SIDE = 200, AREA = SIDE * SIDE, IMAGES = 6, PLANES = 3 * IMAGES, W_COUNT = GGN_GOLDEN_WINDOWS };

struct state {
    struct ggn_trainer *t;
    struct ggn_exec *r, *m, *d; /* evaluation, every value kept */
    real *pixels;               /* [W][18 noisy and 3 of the reference][AREA] */
    const real *noisy_plane[W_COUNT * PLANES], *reference_plane[W_COUNT * 3];
};

struct moments {
    double mean, std, rms;
};

/* Of all planes of a value of images [first, end). */
static struct moments moments_of(const struct ggn_exec *e, int value, int first, int end)
{
    const struct ggn_value *v = &e->graph->value[value];
    double sum = 0, sum_sq = 0, count = (double)(end - first) * v->c * v->h * v->w;

    for (int k = first * v->c; k < end * v->c; k++)
        for (int y = 0; y < v->h; y++)
            for (int x = 0; x < v->w; x++) {
                double p = (double)ggn_exec_plane(e, value, k / v->c, k % v->c)[(long)y * v->row + x];
                sum += p;
                sum_sq += p * p;
            }
    const double mean = sum / count, square = sum_sq / count;
    return (struct moments){mean, sqrt(square - mean * mean), sqrt(square)};
}

#ifndef GGN_DOUBLE /* one for both precisions */
double ggn_golden_pixel(int w, int i, int c, int y, int x)
{
    double v = 0.5 + 0.4 * sin((0.02 + 0.01 * w) * x + (0.03 + 0.02 * w) * y + c + w);

    if (i >= 0) {
        double u = ggn_hash_unit((uint32_t)(c * 40000 + 200 * y + x), (uint32_t)(1000 * (w + 1) + i));
        v += 0.3 / ((1 + w) * (i + 1)) * (2 * u - 1);
    }
    return fmin(fmax(v, 0), 1);
}
#endif

static void fill_windows(struct state *s)
{
    real *plane = s->pixels;

    for (int w = 0; w < W_COUNT; w++)
        for (int c = 0; c < PLANES + 3; c++, plane += AREA) {
            const int reference = c >= PLANES;
            for (int k = 0; k < AREA; k++)
                plane[k] = (real)ggn_golden_pixel(w, reference ? -1 : c / 3, c % 3, k / SIDE, k % SIDE);
            *(reference ? &s->reference_plane[w * 3 + c - PLANES] : &s->noisy_plane[w * PLANES + c]) = plane;
        }
}

static int setup(struct state *s, const struct ggn_golden_seeds *seeds, int train_step, struct base_threads *threads,
                 struct base_err *err)
{
    struct ggn_hyper hyper = ggn_hyper_default(GGN_PRESET_PAPER);
    struct ggn_train_options options = ggn_train_options_default(GGN_PRESET_PAPER);

    options.parts = train_step ? GGN_TRAIN_ALL : 0;
    options.batch = W_COUNT;
    options.dropout = 0;
    s->pixels = malloc((size_t)W_COUNT * (PLANES + 3) * AREA * sizeof *s->pixels);
    if (!s->pixels)
        return base_fail_nomem(err, "golden windows");
    s->t = ggn_trainer_create(&hyper, &options, threads, err);
    if (!s->t)
        return BASE_ENOMEM;
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init(s->t->weights[net], GGN_INIT_HASH, seeds->base[net]);
        ggn_weights_pack(s->t->weights[net], NULL);
    }
    s->r = ggn_exec_create(&s->t->graph[GGN_NET_R], NULL, IMAGES, GGN_EXEC_NO_FUSE, threads, err);
    s->m = ggn_exec_create(&s->t->graph[GGN_NET_M], NULL, 2, GGN_EXEC_NO_FUSE, threads, err);
    s->d = ggn_exec_create(&s->t->graph[GGN_NET_D], NULL, 1, GGN_EXEC_NO_FUSE, threads, err);
    return s->r && s->m && s->d ? 0 : BASE_ENOMEM;
}

static void release(struct state *s)
{
    ggn_trainer_destroy(s->t);
    ggn_exec_destroy(s->r);
    ggn_exec_destroy(s->m);
    ggn_exec_destroy(s->d);
    free(s->pixels);
}

static double value_at(const struct ggn_exec *e, int n, int c, int y, int x)
{
    return (double)ggn_exec_output(e, n, c)[(long)y * ggn_graph_output(e->graph)->row + x];
}

static void record_stages(const struct ggn_exec *e, struct ggn_golden *out)
{
    for (int i = 0; i < e->graph->n_values; i++)
        if (e->graph->value[i].stage && out->n_stages < GGN_GOLDEN_STAGES) {
            out->stage[out->n_stages].name = e->graph->value[i].stage;
            out->stage[out->n_stages++].rms = moments_of(e, i, 0, 1).rms;
        }
}

/* All three networks on window w, as one decision without a history. */
static void evaluate_window(struct state *s, int w)
{
    const int r_row = ggn_graph_output(s->r->graph)->row, m_row = ggn_graph_output(s->m->graph)->row;

    for (int i = 0; i < IMAGES; i++)
        for (int c = 0; c < 3; c++)
            ggn_exec_load(s->r, i, c, s->noisy_plane[w * PLANES + 3 * i + c], SIDE);
    ggn_exec_forward(s->r, s->t->weights[GGN_NET_R], IMAGES, GGN_EVAL);
    for (int k = 0; k < PLANES; k++) {
        ggn_exec_load(s->m, 0, k, ggn_exec_output(s->r, k / 3, k % 3), r_row);
        ggn_exec_load(s->m, 1, k, s->noisy_plane[w * PLANES + k], SIDE);
    }
    ggn_exec_forward(s->m, s->t->weights[GGN_NET_M], 2, GGN_EVAL);
    for (int k = 0; k < 2; k++)
        ggn_exec_load(s->d, 0, k, ggn_exec_output(s->m, k, 0), m_row);
    ggn_exec_forward(s->d, s->t->weights[GGN_NET_D], 1, GGN_EVAL);
}

/* Everything that is reported about window 0. */
static int record_window0(struct state *s, struct ggn_golden *out, struct base_err *err)
{
    const int r = s->r->graph->n_values - 1, m = s->m->graph->n_values - 1;
    const struct moments x = moments_of(s->r, 0, 0, IMAGES), denoised = moments_of(s->r, r, 0, IMAGES);
    const struct moments denoised_map = moments_of(s->m, m, 0, 1), noisy_map = moments_of(s->m, m, 1, 2);
    struct ggn_ssim *ssim = ggn_ssim_create(SIDE, SIDE, NULL, err);
    static const int image[3] = {0, 2, 5};
    const real *reference[3], *denoised0[3];

    if (!ssim)
        return BASE_ENOMEM;
    out->x_first = (double)s->noisy_plane[0][0];
    out->x_last = (double)s->noisy_plane[PLANES - 1][AREA - 1];
    out->x_mean = x.mean;
    out->denoiser_mean = denoised.mean;
    out->denoiser_std = denoised.std;
    out->denoiser_at[0] = value_at(s->r, 0, 0, 0, 0);
    out->denoiser_at[1] = value_at(s->r, 0, 0, 100, 100);
    out->denoiser_at[2] = value_at(s->r, IMAGES - 1, 2, SIDE - 1, SIDE - 1);
    out->generator_noisy_mean = noisy_map.mean;
    out->generator_noisy_std = noisy_map.std;
    for (int i = 0; i < 3; i++)
        out->generator_noisy_at[i] = value_at(s->m, 1, 0, i * 100 - (i == 2), i * 100 - (i == 2));
    out->generator_denoised_mean = denoised_map.mean;
    out->generator_denoised_std = denoised_map.std;
    out->generator_denoised_at = value_at(s->m, 0, 0, 0, 0);
    record_stages(s->r, out);
    record_stages(s->d, out);
    for (int i = 0; i < 3; i++)
        out->ssim[i] = ggn_ssim_mean(ssim, s->noisy_plane + 3 * image[i], s->reference_plane, NULL, 3, SIDE, 0);
    /* Both pictures of one SSIM have rows of one length: the reference takes the place of an input that is done with. */
    for (int c = 0; c < 3; c++) {
        ggn_exec_load(s->r, 0, c, s->reference_plane[c], SIDE);
        reference[c] = ggn_exec_plane(s->r, 0, 0, c);
        denoised0[c] = ggn_exec_output(s->r, 0, c);
    }
    out->ssim[3] = ggn_ssim_mean(ssim, denoised0, reference, NULL, 3, ggn_graph_output(s->r->graph)->row, 0);
    ggn_ssim_destroy(ssim);
    return 0;
}

static double sum_of(const real *x, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)x[i];
    return sum;
}

static int train(struct state *s, struct ggn_golden_train *out, struct base_err *err)
{
    static const double label[W_COUNT] = {1, 0, 1, 0};
    struct ggn_batch batch = {.count = W_COUNT, .noisy = s->noisy_plane, .reference = s->reference_plane, .label = label};
    int rc = ggn_trainer_paper_step(s->t, &batch, &out->step, err);

    if (rc)
        return rc;
    for (int i = 0; i < W_COUNT; i++) {
        out->d_prob_before[i] = ggn_sigmoid(out->step.logit_before[i]);
        out->d_prob_after[i] = ggn_sigmoid(out->step.logit_after[i]);
    }
    for (int net = 0; net < GGN_NETS; net++) {
        const struct ggn_weights *w = s->t->weights[net];
        out->sum_params[net] = sum_of(w->params, w->graph->n_params);
        out->sum_running_mean[net] = sum_of(w->mean, w->graph->n_stats);
        out->sum_running_var[net] = sum_of(w->var, w->graph->n_stats);
    }
    return 0;
}

int ggn_golden_run(const struct ggn_golden_seeds *seeds, int train_step, struct base_threads *threads,
                   struct ggn_golden *out, struct base_err *err)
{
    struct state s = {0};
    int rc = setup(&s, seeds, train_step, threads, err);

    memset(out, 0, sizeof *out);
    if (!rc)
        fill_windows(&s);
    for (int w = 0; w < W_COUNT && !rc; w++) {
        evaluate_window(&s, w);
        out->logit[w] = value_at(s.d, 0, 0, 0, 0);
        out->p[w] = ggn_sigmoid(out->logit[w]);
        if (w == 0)
            rc = record_window0(&s, out, err);
    }
    if (!rc && train_step)
        rc = train(&s, &out->train, err);
    release(&s);
    return rc;
}
