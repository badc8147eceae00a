/* The denoiser of preset lull. */
#include <math.h>

#include "nn/hash.h"
#include "train/phase.h"
#include "train/start.h"

enum { VALIDATION_CROPS = 32 };
static const uint32_t VALIDATION_SEED = 77;

/* One sample of a step: which series and level, which crop. */
struct crop {
    int series, level, x0, y0;
    struct ggn_augment augment;
};

static double draw(uint32_t what, uint64_t step, int i, uint32_t seed)
{
    return ggn_hash_unit(what, ggn_hash((uint32_t)i, ggn_hash((uint32_t)step, seed)));
}

/* The k-th series of the split that has a reference; their number when k < 0. */
static int nth_series(const struct ggn_session *s, enum ggn_split split, int k)
{
    int n = 0;
    for (int i = 0; i < s->set.n; i++)
        if (s->set.series[i].split == split && s->set.series[i].reference && s->set.series[i].n_levels && n++ == k)
            return i;
    return n;
}

static struct crop draw_crop(const struct ggn_session *s, enum ggn_split split, uint64_t step, int i, uint32_t seed)
{
    const int size = s->crop, series = nth_series(s, split, -1);
    struct crop c = {.series = nth_series(s, split, (int)(draw(21, step, i, seed) * series)), .augment = ggn_augment_none()};
    c.level = (int)(draw(22, step, i, seed) * s->set.series[c.series].n_levels);
    c.x0 = (int)(draw(23, step, i, seed) * (s->set.width - size + 1));
    c.y0 = (int)(draw(24, step, i, seed) * (s->set.height - size + 1));
    if (split == GGN_SPLIT_TRAIN)
        c.augment =
            ggn_augment_draw(step, i, seed ^ 1, &(struct ggn_augment_options){s->plan->flips, 1, s->plan->jitter, 0});
    return c;
}

struct fill {
    struct ggn_session *s;
    enum ggn_split split;
    uint64_t step;
    uint32_t seed;
    int first;
};

static void fill_sample(void *data, long i, int worker)
{
    const struct fill *f = data;
    const int size = f->s->crop;
    const size_t values = 3 * (size_t)size * (size_t)size;
    struct crop c = draw_crop(f->s, f->split, f->step, f->first + (int)i, f->seed);
    float *noisy = f->s->buffer + 2 * (size_t)i * values;
    ggn_crop_planes(&f->s->set.series[c.series], c.level, f->s->set.width, f->s->set.height, c.x0, c.y0, size, size,
                    &c.augment, noisy, noisy + values);
    (void)worker;
}

/* Into the buffer, each crop and its reference; pointers to their planes: of all crops, then of the references. */
static void fill_batch(struct ggn_session *s, enum ggn_split split, uint64_t step, uint32_t seed, int first, int count)
{
    struct fill f = {s, split, step, seed, first};
    const size_t plane = (size_t)s->crop * (size_t)s->crop;
    base_threads_for(s->threads, count, fill_sample, &f);
    for (int i = 0; i < 3 * count; i++) {
        s->planes[i] = s->buffer + ((size_t)(i / 3) * 6 + (size_t)(i % 3)) * plane;
        s->planes[3 * s->plan->batch_r + i] = s->planes[i] + 3 * plane;
    }
}

static int train_step(struct ggn_session *s, uint64_t step, uint64_t steps, double *loss, double *right,
                      struct base_err *err)
{
    const int n = s->plan->batch_r;
    fill_batch(s, GGN_SPLIT_TRAIN, step, ggn_session_seed(s), 0, n);
    *right = (double)NAN;
    s->trainer->options.lr[GGN_NET_R] = ggn_session_lr(s, s->plan->lr_r, step, steps);
    return ggn_trainer_denoiser_step(s->trainer, s->planes, s->planes + 3 * n, n, loss, err);
}

/* Mean of 1 − SSIM over fixed crops of the validation scenes; NaN without any. */
static int validate(struct ggn_session *s, struct ggn_log_row *row, struct base_err *err)
{
    const int n = s->plan->batch_r, any = nth_series(s, GGN_SPLIT_VALIDATION, -1);
    double loss[VALIDATION_CROPS] = {0}, total = 0;
    ggn_weights_pack(s->trainer->weights[GGN_NET_R], NULL);
    for (int first = 0; any && first < VALIDATION_CROPS; first += n) {
        int count = VALIDATION_CROPS - first < n ? VALIDATION_CROPS - first : n;
        fill_batch(s, GGN_SPLIT_VALIDATION, 0, VALIDATION_SEED, first, count);
        ggn_trainer_denoiser_losses(s->trainer, s->planes, s->planes + 3 * n, count, loss + first);
    }
    for (int i = 0; i < VALIDATION_CROPS; i++)
        total += loss[i];
    row->validation_loss = any ? total / VALIDATION_CROPS : (double)NAN;
    row->validation_accuracy = row->validation_auc = (double)NAN;
    (void)err;
    return 0;
}

int ggn_phase_denoiser(struct ggn_session *s, struct base_err *err)
{
    const struct ggn_phase phase = {.steps = (uint64_t)s->plan->steps_r,
                                    .epoch_steps = (uint64_t)s->plan->epoch_steps,
                                    .batch = s->plan->batch_r,
                                    .net = GGN_NET_R,
                                    .step = train_step,
                                    .validate = validate};
    if (!nth_series(s, GGN_SPLIT_TRAIN, -1) && phase.steps)
        return base_fail(err, BASE_EINVAL, "%s: no training block has a reference for the denoiser", s->plan->data.dir);
    s->progress.phase = GGN_PHASE_DENOISER;
    int rc = ggn_session_begin(s, GGN_TRAIN_R, phase.batch, s->crop, s->crop, err);
    if (rc)
        return rc;
    struct ggn_weights *w = s->trainer->weights[GGN_NET_R];
    if (s->init)
        ggn_weights_copy(w, s->init->weights[GGN_NET_R]->params);
    else
        ggn_train_identity(w->graph, w->params);
    rc = ggn_resume_load(s, err);
    if (!rc)
        rc = ggn_phase_run(s, &phase, err);
    if (rc)
        return rc;
    ggn_weights_copy(s->model->weights[GGN_NET_R], s->trainer->weights[GGN_NET_R]->params);
    return 0;
}
