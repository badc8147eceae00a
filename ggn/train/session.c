#include "train/session.h"

#include <math.h>
#include <stdlib.h>

#include "base/pi.h"
#include "nn/hash.h"
#include "sight/observer.h"

double ggn_session_lr(const struct ggn_session *s, double lr, uint64_t step, uint64_t steps)
{
    static const double LOWEST = 0.02;
    double t = steps ? (double)step / (double)steps : 0, warm = fmin(1, ((double)step + 1) / fmax(20, 0.02 * (double)steps));
    return lr * warm * (LOWEST + (1 - LOWEST) * 0.5 * (1 + cos(BASE_PI * t))) * ldexp(1, -s->progress.divergences);
}

uint32_t ggn_session_seed(const struct ggn_session *s)
{
    return ggn_hash(s->plan->seed, 1000 + (uint32_t)(10 * s->progress.divergences + s->progress.phase));
}

double ggn_session_law(const struct ggn_session *s, const struct ggn_level_series *c, int k)
{
    const size_t pixels = (size_t)s->set.width * (size_t)s->set.height;
    return ggn_measure_octaves(ggn_observer_error(&ggn_observer_default, c->measure[k].visible, pixels));
}

static int side_of(const struct ggn_session *s) { return s->set.width < s->set.height ? s->set.width : s->set.height; }

static int check_plan(const struct ggn_session *s, struct base_err *err)
{
    const struct ggn_train_plan *p = s->plan;
    const int paper = p->hyper.preset == GGN_PRESET_PAPER;
    if (p->batch < 1 || p->batch > GGN_BATCH_MAX || p->batch_r < 1 || p->batch_r > GGN_BATCH_MAX)
        return base_fail(err, BASE_EINVAL, "a batch has 1 to 1024 samples");
    if (!paper && (s->crop < 16 || s->crop > s->set.width || s->crop > s->set.height))
        return base_fail(err, BASE_EINVAL, "crop %d is not in 16..%d, the side of the blocks", s->crop, side_of(s));
    if (paper && (p->noise_map > 0 || p->hyper.reach > 0))
        return base_fail(err, BASE_EINVAL, "preset paper has neither noise pictures nor a residual");
    if (p->noise_map > 0 && !(p->hyper.reach > 0))
        return base_fail(err, BASE_EINVAL, "a noise picture is of the visible noise: --picture goes with --residual");
    if (p->hyper.k_r < 3)
        return base_fail(err, BASE_EINVAL, "the denoiser needs a width of at least 3");
    if (!s->train.n)
        return base_fail(err, BASE_EINVAL, "%s: no training block has a label and %d levels; run `ggn label` first",
                         p->data.dir, p->hyper.window);
    int noisy = 0;
    for (int i = 0; i < s->train.n; i++) {
        noisy += s->train.list[i].noisy;
        if (paper && !s->set.series[s->train.list[i].series].reference)
            return base_fail(err, BASE_EINVAL, "%s: preset paper needs a reference for each training block", p->data.dir);
        if (p->hyper.reach > 0 && isnan(s->set.series[s->train.list[i].series].measure[s->train.list[i].last].visible))
            return base_fail(err, BASE_EINVAL, "%s: --residual needs half buffers at every recorded level", p->data.dir);
    }
    if (noisy == 0 || noisy == s->train.n)
        return base_fail(err, BASE_EINVAL, "%s: all %d training windows are %s: nothing to tell apart", p->data.dir,
                         s->train.n, noisy ? "noisy" : "free of noise");
    return 0;
}

int ggn_session_init(struct ggn_session *s, struct base_err *err)
{
    /* The data first: they say how large networks and crops are, and what of the plan can be done. */
    const struct ggn_train_plan *p = s->plan;
    const int paper = p->hyper.preset == GGN_PRESET_PAPER;
    s->threads = base_threads_create(p->threads > 0 ? p->threads : base_threads_available(), err);
    struct ggn_series_set_options data = p->data;
    data.noise_maps = p->noise_map > 0;
    data.measures = data.keep_recorded = p->hyper.reach > 0;
    s->scale = ggn_observer_slope(&ggn_observer_default);
    int rc = s->threads ? ggn_series_set_load(&s->set, &data, err) : BASE_ENOMEM;

    /* After loading, since a small block is smaller than the usual crop. */
    s->crop = p->crop || paper ? p->crop : side_of(s) < GGN_TRAIN_CROP ? side_of(s) : GGN_TRAIN_CROP;
    if (!rc && p->synthetic > 0)
        rc = ggn_series_set_add_synthetic(&s->set, p->synthetic, p->seed, err);
    if (!rc && p->extend)
        rc = ggn_series_set_extend(&s->set, 0, p->seed, err);
    if (rc)
        return rc;
    struct ggn_window_options train = {
        .split = GGN_SPLIT_TRAIN, .length = p->hyper.window, .synthetic = 1, .label_first = paper, .soft = p->soft_labels};
    struct ggn_window_options validation = {
        .split = GGN_SPLIT_VALIDATION, .length = p->hyper.window, .synthetic = p->hyper.reach > 0, .soft = p->soft_labels};
    rc = ggn_windows_create(&s->train, &s->set, &train, err);
    if (!rc)
        rc = ggn_windows_create(&s->validation, &s->set, &validation, err);
    s->data_crc = ggn_series_set_crc(&s->set);
    if (!rc)
        rc = check_plan(s, err);
    if (rc)
        return rc;
    s->hyper = p->hyper;
    s->hyper.height = s->set.height;
    s->hyper.width = s->set.width;
    s->hyper.noise_map = p->noise_map > 0;
    s->hyper.scalars = p->hyper.reach > 0 && p->scalars ? GGN_SCALARS : 0;
    s->model = ggn_model_create(&s->hyper, err);
    if (!s->model)
        return err->code;
    /* One buffer for both phases, which never run at the same time. */
    size_t crops = 6 * (size_t)p->batch_r * (size_t)s->crop * (size_t)s->crop;
    size_t windows = (size_t)p->batch * (2 * (size_t)p->hyper.window + 1) * ggn_series_set_values(&s->set);
    size_t pointers = 6 * (size_t)p->batch_r + (6 * (size_t)p->hyper.window + 2) * (size_t)p->batch;
    s->buffer = malloc((crops > windows ? crops : windows) * sizeof *s->buffer);
    s->planes = malloc(pointers * sizeof *s->planes);
    return s->buffer && s->planes ? 0 : base_fail_nomem(err, "a batch");
}

void ggn_session_release(struct ggn_session *s)
{
    ggn_trainer_destroy(s->trainer);
    ggn_container_release(&s->checkpoint);
    ggn_model_destroy(s->model);
    ggn_model_destroy(s->init);
    free(s->buffer);
    free((void *)s->planes);
    ggn_log_release(&s->log);
    ggn_windows_release(&s->train);
    ggn_windows_release(&s->validation);
    ggn_series_set_release(&s->set);
    base_threads_destroy(s->threads);
}

int ggn_session_load_init(struct ggn_session *s, struct base_err *err)
{
    int rc = ggn_model_load(s->plan->init, &s->init, err);
    if (rc)
        return rc;
    const struct ggn_hyper *a = &s->init->hyper, *b = &s->hyper;
    if (a->preset == b->preset && a->height == b->height && a->width == b->width && a->window == b->window &&
        a->k_r == b->k_r && a->k_m == b->k_m && a->k_d == b->k_d && a->noise_map == b->noise_map &&
        (a->reach > 0) == (b->reach > 0) && a->scalars == b->scalars)
        return 0;
    return base_fail(err, BASE_EINVAL, "%s: networks of another size, preset or input", s->plan->init);
}

int ggn_session_begin(struct ggn_session *s, int parts, int batch, int height, int width, struct base_err *err)
{
    struct ggn_train_options o = ggn_train_options_default(s->plan->hyper.preset);
    struct ggn_hyper hyper = s->hyper;
    hyper.height = height;
    hyper.width = width;
    o.parts = parts;
    o.batch = batch;
    o.seed = s->plan->seed;
    o.scale = s->scale;
    o.lr[GGN_NET_R] = s->plan->lr_r;
    o.lr[GGN_NET_M] = o.lr[GGN_NET_D] = s->plan->lr;
    ggn_trainer_destroy(s->trainer);
    s->trainer = ggn_trainer_create(&hyper, &o, s->threads, err);
    return s->trainer ? 0 : BASE_ENOMEM;
}
