/* Generator and discriminator, or all three networks of preset paper. */
#include <math.h>
#include <stdlib.h>

#include "sight/stats.h"
#include "model/window.h"
#include "nn/hash.h"
#include "nn/loss.h"
#include "train/fit_policy.h"
#include "train/phase.h"
#include "train/start.h"

/* Of a sample: the window, the second window or reference, and noise map and scalars, which need no more than an image. */
static size_t sample_values(const struct ggn_session *s)
{
    return (2 * (size_t)s->hyper.window + 1) * ggn_series_set_values(&s->set);
}

static size_t window_values(const struct ggn_session *s) { return (size_t)s->hyper.window * ggn_series_set_values(&s->set); }

static float difference(const struct ggn_session *s)
{
    return s->hyper.preset == GGN_PRESET_LULL ? (float)s->plan->difference : 0;
}

struct fill {
    struct ggn_session *s;
    const struct ggn_windows *windows;
    const int *index; /* of the windows */
    uint64_t step;
    int augment, denoised;
    double label[GGN_BATCH_MAX], law[GGN_BATCH_MAX]; /* of the samples, see ggn_batch */
};

static void fill_window(void *data, long i, int worker)
{
    struct fill *f = data;
    const struct ggn_session *s = f->s;
    const struct ggn_window *w = &f->windows->list[f->index[i]];
    const struct ggn_level_series *c = &s->set.series[w->series];
    const struct ggn_augment_options how = {s->plan->flips, s->set.width == s->set.height,
                                            s->plan->hyper.reach > 0 ? 0 : s->plan->jitter, s->plan->noise_map};
    struct ggn_augment augment =
        f->augment ? ggn_augment_draw(f->step, (int)i, ggn_session_seed(s) ^ 2, &how) : ggn_augment_none();
    float *at = s->buffer + (size_t)i * sample_values(s), *noise_map = at + 2 * window_values(s);
    f->label[i] = w->label;
    f->law[i] = s->hyper.reach > 0 ? ggn_session_law(s, c, w->last) : 0;

    ggn_window_planes(c, w->last, s->hyper.window, s->set.width, s->set.height, 0, &augment, difference(s), at);
    at += window_values(s);
    if (f->denoised) {
        ggn_window_planes(c, w->last, s->hyper.window, s->set.width, s->set.height, 1, &augment, difference(s), at);
    } else {
        /* the reference, in the place of the window that preset paper denoises itself */
        struct ggn_level_series once = *c;
        once.noisy = c->reference;
        ggn_window_planes(&once, 0, 1, s->set.width, s->set.height, 0, &augment, 0, at);
    }
    s->planes[6 * (size_t)s->hyper.window * (size_t)s->plan->batch + (size_t)i] =
        ggn_noise_map_plane(c, w->last, s->set.width, s->set.height, &augment, noise_map) ? noise_map : NULL;
    if (s->hyper.scalars) {
        const int first = w->last - s->hyper.window + 1;
        float *scalars = noise_map + ggn_series_set_values(&s->set) - GGN_SCALARS;
        ggn_measure_scalars(c->measure + first, c->spp + first, s->hyper.window, f->law[i], scalars);
        s->planes[(6 * (size_t)s->hyper.window + 1) * (size_t)s->plan->batch + (size_t)i] = scalars;
    }
    (void)worker;
}

/* Fills the buffer and the plane pointers: noisy windows first, then denoised ones (or references), then noise maps. */
static struct ggn_batch fill_batch(struct fill *f, int count)
{
    const struct ggn_session *s = f->s;
    const size_t plane = (size_t)s->set.width * (size_t)s->set.height;
    const size_t planes = 3 * (size_t)s->hyper.window;
    const float **noisy = s->planes, **second = s->planes + planes * (size_t)s->plan->batch;
    base_threads_for(s->threads, count, fill_window, f);
    for (size_t i = 0; i < (size_t)count; i++)
        for (size_t k = 0; k < planes; k++) {
            noisy[i * planes + k] = s->buffer + i * sample_values(s) + k * plane;
            if (f->denoised)
                second[i * planes + k] = noisy[i * planes + k] + window_values(s);
            else if (k < 3)
                second[3 * i + k] = noisy[i * planes + k] + window_values(s);
        }
    return (struct ggn_batch){.count = count,
                              .noisy = noisy,
                              .denoised = f->denoised ? second : NULL,
                              .reference = f->denoised ? NULL : second,
                              .noise_map = second + planes * (size_t)s->plan->batch,
                              .scalars = second + (planes + 1) * (size_t)s->plan->batch,
                              .law = f->law,
                              .label = f->label};
}

/* Raw logits of windows list[index[i]], i < n, with the weights as they are. */
static void logits(struct ggn_session *s, const struct ggn_windows *windows, const int *index, int n, double *logit)
{
    const int most = s->plan->batch;
    ggn_weights_pack(s->trainer->weights[GGN_NET_M], NULL);
    ggn_weights_pack(s->trainer->weights[GGN_NET_D], NULL);
    for (int first = 0; first < n; first += most) {
        struct fill f = {.s = s, .windows = windows, .index = index + first, .denoised = 1};
        struct ggn_batch b = fill_batch(&f, n - first < most ? n - first : most);
        ggn_trainer_answers(s->trainer, &b, logit + first);
    }
}

enum { DENOISED_AT_ONCE = 4 }; /* images */

/* All levels of a series, in evaluation mode. */
static int denoise_series(const struct ggn_session *s, struct ggn_exec *exec, struct ggn_weights *r,
                          struct ggn_level_series *c, struct base_err *err)
{
    const struct ggn_value *in = &exec->graph->value[0], *out = ggn_graph_output(exec->graph);
    const int width = s->set.width, height = s->set.height;
    const size_t values = ggn_series_set_values(&s->set);
    if (!c->denoised)
        c->denoised = malloc((size_t)c->n_levels * values * sizeof *c->denoised + 1);
    if (!c->denoised)
        return base_fail_nomem(err, "denoised images");
    for (int first = 0; first < c->n_levels; first += DENOISED_AT_ONCE) {
        const int count = c->n_levels - first < DENOISED_AT_ONCE ? c->n_levels - first : DENOISED_AT_ONCE;
        const uint8_t *noisy = c->noisy + (size_t)first * values;
        uint16_t *denoised = c->denoised + (size_t)first * values;
        for (int i = 0; i < count; i++, noisy += values)
            ggn_tile_load_u8(noisy, 3, width, height, 0, 0, 1.0F / 255, ggn_exec_plane(exec, 0, i, 0), in);
        ggn_exec_forward(exec, r, count, GGN_EVAL);
        for (int i = 0; i < count; i++, denoised += values)
            ggn_tile_store_u16(denoised, width, height, 0, 0, ggn_exec_output(exec, i, 0), out);
    }
    return 0;
}

/* Denoises the series of one split (GGN_SPLITS: all). */
static int denoise(struct ggn_session *s, struct ggn_weights *r, enum ggn_split split, struct base_err *err)
{
    struct ggn_exec *exec = ggn_exec_create(r->graph, NULL, DENOISED_AT_ONCE, 0, s->threads, err);
    int rc = exec ? 0 : BASE_ENOMEM;
    ggn_weights_pack(r, NULL);
    for (int i = 0; i < s->set.n && !rc; i++)
        if (split == GGN_SPLITS || s->set.series[i].split == split)
            rc = denoise_series(s, exec, r, &s->set.series[i], err);
    ggn_exec_destroy(exec);
    return rc;
}

/* Steps of an epoch over all windows (preset paper). */
static uint64_t epoch_length(const struct ggn_session *s)
{
    uint64_t n = (uint64_t)(s->train.n / s->plan->batch);
    return n ? n : 1;
}

/* Sample i of a step of preset paper: all windows once per epoch, in an order drawn for it. Sorting by hash is a permutation
 * that needs no memory between steps; walking it with a stride coprime to n would repeat neighbours, this does not. */
static int paper_window(const struct ggn_session *s, uint64_t step, int i)
{
    const uint32_t n = (uint32_t)s->train.n, seed = ggn_hash((uint32_t)(step / epoch_length(s)), ggn_session_seed(s));
    uint32_t bits = 1, k = (uint32_t)(step % epoch_length(s)) * (uint32_t)s->plan->batch + (uint32_t)i;
    while (UINT32_C(1) << bits < n)
        bits++;
    /* A Feistel-like walk: each round is a bijection on [0, 2^bits); values beyond n are walked on. */
    const uint32_t mask = (UINT32_C(1) << bits) - 1;
    k %= n;
    do {
        for (uint32_t round = 0; round < 4; round++) {
            k = (k + ggn_hash(round, seed)) & mask;
            k = (k * (2 * (ggn_hash(round, seed ^ 5) >> 1) + 1)) & mask;
            k ^= k >> (bits / 2 + 1);
        }
    } while (k >= n);
    return (int)k;
}

static int train_step(struct ggn_session *s, uint64_t step, uint64_t steps, double *loss, double *right,
                      struct base_err *err)
{
    const int paper = s->hyper.preset == GGN_PRESET_PAPER, n = s->plan->batch;
    int index[GGN_BATCH_MAX];
    double logit[GGN_BATCH_MAX];
    struct ggn_paper_record record;
    for (int i = 0; i < n; i++)
        index[i] = paper ? paper_window(s, step, i) : ggn_windows_draw(&s->train, step, i, ggn_session_seed(s));
    struct fill f = {.s = s, .windows = &s->train, .index = index, .step = step, .augment = !paper, .denoised = !paper};
    struct ggn_batch b = fill_batch(&f, n);
    double scale = paper ? 1 : ggn_session_lr(s, 1, step, steps);
    s->trainer->options.lr[GGN_NET_M] = s->trainer->options.lr[GGN_NET_D] = s->plan->lr * scale;
    s->trainer->options.lr[GGN_NET_R] = s->plan->lr_r * scale;
    int rc = paper ? ggn_trainer_paper_step(s->trainer, &b, &record, err)
                   : ggn_trainer_classifier_step(s->trainer, &b, loss, logit, err);
    if (rc)
        return rc;
    if (paper)
        *loss = record.bce_before;
    *right = 0;
    for (int i = 0; i < n; i++) {
        double z = !paper ? logit[i] : i < 64 ? record.logit_before[i] : (double)NAN;
        *right += (z > 0) == s->train.list[index[i]].noisy;
    }
    *right /= n;
    return 0;
}

/* Loss and accuracy are those of the calibrated probability, as the model will be used: from epoch to epoch the logits of
 * all windows shift together, which says nothing about the model (loss 0.18 and 0.41 at an AUC of 0.992 and 0.995). */
static void calibrate(const struct ggn_session *s, const double *label, const unsigned char *noisy, int n,
                      struct ggn_classified *o)
{
    struct ggn_policy *p = &o->policy;
    int right = 0;
    if (s->hyper.reach <= 0)
        ggn_calibrate_platt(o->logit, label, n, p);
    else
        p->scale = s->scale;
    o->loss = 0;
    for (int i = 0; i < n; i++) {
        right += (ggn_policy_p(p, o->logit[i]) >= 0.5) == noisy[i];
        o->loss += ggn_bce(p->scale * o->logit[i] + p->shift, label[i]) / n;
    }
    o->accuracy = (double)right / n;
}

int ggn_classify_validation(struct ggn_session *s, int most, struct ggn_classified *o, struct base_err *err)
{
    const int n = s->validation.n < most ? s->validation.n : most;
    const size_t room = (size_t)n + 1;
    int *index = malloc(room * sizeof *index), rc = 0;
    double *label = malloc(room * sizeof *label);
    unsigned char *noisy = malloc(room);
    *o = (struct ggn_classified){.logit = malloc(room * sizeof *o->logit),
                                 .auc = (double)NAN,
                                 .loss = (double)NAN,
                                 .accuracy = (double)NAN,
                                 .policy = ggn_policy_default()};
    if (!index || !label || !noisy || !o->logit)
        rc = base_fail_nomem(err, "validation");
    for (int i = 0; !rc && i < n; i++) {
        index[i] = (int)((long)i * s->validation.n / n);
        label[i] = s->validation.list[index[i]].label;
        noisy[i] = (unsigned char)s->validation.list[index[i]].noisy;
    }
    if (!rc && n) {
        logits(s, &s->validation, index, n, o->logit);
        calibrate(s, label, noisy, n, o);
        rc = ggn_stats_auc(o->logit, noisy, (size_t)n, &o->auc, err);
    }
    free(index);
    free(label);
    free(noisy);
    return rc;
}

/* The networks that the phase trains begin with this one. */
static int first_net(const struct ggn_session *s) { return s->hyper.preset == GGN_PRESET_PAPER ? GGN_NET_R : GGN_NET_M; }

/* The loss on the validation scenes chooses the epoch. The AUC does not: with few blocks it saturates within a hundred
 * steps, and the networks of that time are far from what they learn later (they stopped 18 % of the training blocks early).
 */
static void note_best(struct ggn_session *s, const struct ggn_log_row *row)
{
    struct ggn_progress *p = &s->progress;
    /* without validation windows (or with one class only) the last epoch counts; a checkpoint knows no infinity, only NaN */
    int better = isnan(row->validation_auc) || !(row->validation_loss >= p->best_loss);
    p->stale = better ? 0 : p->stale + 1;
    if (!better)
        return;
    p->best_loss = row->validation_loss;
    p->best_step = p->step;
    for (int net = first_net(s); net < GGN_NETS; net++)
        ggn_weights_copy(s->model->weights[net], s->trainer->weights[net]->params);
}

static int validate(struct ggn_session *s, struct ggn_log_row *row, struct base_err *err)
{
    struct ggn_classified v;
    /* In preset paper the denoiser has moved on: the denoised validation images follow. */
    int rc = s->hyper.preset == GGN_PRESET_PAPER ? denoise(s, s->trainer->weights[GGN_NET_R], GGN_SPLIT_VALIDATION, err) : 0;
    if (rc)
        return rc;
    rc = ggn_classify_validation(s, s->plan->validation_windows, &v, err);
    row->validation_auc = v.auc;
    row->validation_loss = v.loss;
    row->validation_accuracy = v.accuracy;
    free(v.logit);
    if (!rc)
        note_best(s, row);
    return rc;
}

static int begin(struct ggn_session *s, struct base_err *err)
{
    const int paper = s->hyper.preset == GGN_PRESET_PAPER;
    s->progress = (struct ggn_progress){.phase = GGN_PHASE_CLASSIFIER,
                                        .best_loss = HUGE_VAL,
                                        .seconds = {s->progress.seconds[0], 0},
                                        .processor_s = {s->progress.processor_s[0], 0}};
    int rc =
        ggn_session_begin(s, paper ? GGN_TRAIN_ALL : GGN_TRAIN_MD, s->plan->batch, s->hyper.height, s->hyper.width, err);
    for (int net = first_net(s); net < GGN_NETS && !rc && s->init; net++)
        ggn_weights_copy(s->trainer->weights[net], s->init->weights[net]->params);
    if (!rc && s->init && !paper)
        ggn_train_fold(&s->trainer->graph[GGN_NET_M], s->trainer->weights[GGN_NET_M]->params, s->hyper.window,
                       s->plan->difference, 1);
    return rc;
}

int ggn_phase_classifier(struct ggn_session *s, struct base_err *err)
{
    const struct ggn_train_plan *p = s->plan;
    const int paper = p->hyper.preset == GGN_PRESET_PAPER;
    const struct ggn_phase phase = {.steps = p->steps ? (uint64_t)p->steps : (uint64_t)p->epochs * epoch_length(s),
                                    .epoch_steps = p->epoch_steps ? (uint64_t)p->epoch_steps : epoch_length(s),
                                    .batch = p->batch,
                                    .net = GGN_NET_M,
                                    .step = train_step,
                                    .validate = validate};
    /* The checkpoint first: it holds the denoiser that all images are denoised with. */
    int rc = begin(s, err);
    if (!rc)
        rc = ggn_resume_load(s, err);
    if (!rc && !paper)
        rc = denoise(s, s->model->weights[GGN_NET_R], GGN_SPLITS, err);
    if (!rc)
        rc = ggn_phase_run(s, &phase, err);
    if (rc)
        return rc;
    for (int net = GGN_NET_M; net < GGN_NETS; net++)
        ggn_weights_copy(s->trainer->weights[net], s->model->weights[net]->params);
    return paper ? denoise(s, s->model->weights[GGN_NET_R], GGN_SPLIT_VALIDATION, err) : 0;
}
