#include "model/trainer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sight/measure.h"
#include "nn/hash.h"
#include "nn/loss.h"
#include "nn/ssim.h"
#include "nn/real.h"

enum { N_STATE = 5 };

struct ggn_train_options ggn_train_options_default(enum ggn_preset preset)
{
    int lull = preset == GGN_PRESET_LULL;
    enum ggn_init plain = lull ? GGN_INIT_HE : GGN_INIT_PAPER;
    return (struct ggn_train_options){
        .parts = GGN_TRAIN_ALL,
        .batch = lull ? 16 : 64,
        .lr = {2e-4, 2e-4, 2e-4},
        .beta1 = 0.5,
        .beta2 = 0.999,
        .eps = 1e-8,
        .clip = lull ? 1 : 0,
        .explode = 1e6,
        .dropout = 1,
        .init = {plain, plain, lull ? GGN_INIT_HE : GGN_INIT_GAN},
        .seed = 1,
    };
}

static int part_of(int net) { return net == GGN_NET_R ? GGN_TRAIN_R : GGN_TRAIN_MD; }

real *ggn_trainer_state(struct ggn_trainer *t, int net, int i, size_t *count)
{
    struct ggn_weights *w = t->weights[net];
    real *const array[N_STATE] = {w->params, w->mean, w->var, t->adam_m[net], t->adam_v[net]};
    if (i < 0 || i >= N_STATE || !array[i])
        return NULL;
    *count = i == 1 || i == 2 ? t->graph[net].n_stats : t->graph[net].n_params;
    return array[i];
}

/* Copies the state of a network to (or from) its last good one. */
static void copy_state(struct ggn_trainer *t, int net, int keep)
{
    real *good = t->good[net], *now;
    size_t count;
    for (int i = 0; good && (now = ggn_trainer_state(t, net, i, &count)); i++, good += count)
        memcpy(keep ? good : now, keep ? now : good, count * sizeof *now);
}

void ggn_trainer_keep(struct ggn_trainer *t)
{
    for (int net = 0; net < GGN_NETS; net++) {
        copy_state(t, net, 1);
        t->good_t[net] = t->adam_t[net];
    }
    t->good_steps = t->steps;
}

static void roll_back(struct ggn_trainer *t)
{
    for (int net = 0; net < GGN_NETS; net++)
        if (t->good[net]) {
            copy_state(t, net, 0);
            t->adam_t[net] = t->good_t[net];
            ggn_weights_pack(t->weights[net], NULL);
        }
    t->steps = t->good_steps;
}

static int create_net(struct ggn_trainer *t, int net, struct base_err *err)
{
    int trained = (t->options.parts & part_of(net)) != 0;
    int rc = ggn_network_build(&t->graph[net], net, &t->hyper, err);
    if (rc)
        return rc;
    t->weights[net] = ggn_weights_create(&t->graph[net], NULL, trained ? GGN_WEIGHTS_BACKWARD : 0, err);
    if (!t->weights[net])
        return BASE_ENOMEM;
    ggn_weights_init(t->weights[net], t->options.init[net], t->options.seed + 1000u * (uint32_t)net);
    if (net == GGN_NET_D && t->hyper.reach > 0) { /* its last layer: an untrained network corrects nothing */
        const size_t last = t->graph[net].tensor[t->graph[net].n_tensors - 2].offset;
        memset(t->weights[net]->params + last, 0, (t->graph[net].n_params - last) * sizeof(real));
    }
    ggn_weights_pack(t->weights[net], NULL);
    if (!trained)
        return 0;
    const size_t n = t->graph[net].n_params;
    t->grad[net] = calloc(5 * n + t->graph[net].n_learned, sizeof(real));
    if (!t->grad[net])
        return base_fail_nomem(err, "optimiser");
    t->adam_m[net] = t->grad[net] + n;
    t->adam_v[net] = t->adam_m[net] + n;
    t->good[net] = t->adam_v[net] + n;
    return 0;
}

static int create_execs(struct ggn_trainer *t, struct base_err *err)
{
    const int batch = t->options.batch, paper = t->hyper.preset == GGN_PRESET_PAPER;
    const int drop = t->options.dropout ? 0 : GGN_EXEC_NO_DROPOUT, per_sample = paper ? 1 : 2;
    if (t->options.parts & GGN_TRAIN_R) {
        t->r = ggn_exec_create(&t->graph[GGN_NET_R], NULL, batch, GGN_EXEC_GRADS, t->threads, err);
        t->ssim = t->r ? ggn_ssim_create(t->hyper.height, t->hyper.width, t->threads, err) : NULL;
        if (!t->ssim)
            return BASE_ENOMEM;
    }
    if (t->options.parts & GGN_TRAIN_MD) {
        const struct ggn_graph *m = &t->graph[GGN_NET_M];
        t->m = ggn_exec_create(m, NULL, per_sample * batch, GGN_EXEC_GRADS, t->threads, err);
        t->d =
            ggn_exec_create(&t->graph[GGN_NET_D], NULL, batch, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD | drop, t->threads, err);
        if (!t->m || !t->d)
            return BASE_ENOMEM;
        if (paper && !(t->m2 = ggn_exec_create(m, NULL, batch, GGN_EXEC_GRADS, t->threads, err)))
            return BASE_ENOMEM;
    }
    return 0;
}

struct ggn_trainer *ggn_trainer_create(const struct ggn_hyper *hyper, const struct ggn_train_options *options,
                                       struct base_threads *threads, struct base_err *err)
{
    if (options->batch < 1 || options->batch > GGN_BATCH_MAX) {
        base_fail(err, BASE_EINVAL, "batch size %d is not in 1..%d", options->batch, GGN_BATCH_MAX);
        return NULL;
    }
    struct ggn_trainer *t = calloc(1, sizeof *t);
    if (!t) {
        base_fail_nomem(err, "trainer");
        return NULL;
    }
    t->hyper = *hyper;
    t->options = *options;
    t->threads = threads;
    int rc = 0;
    for (int net = 0; net < GGN_NETS && !rc; net++)
        rc = create_net(t, net, err);
    if (!rc)
        rc = create_execs(t, err);
    if (rc) {
        ggn_trainer_destroy(t);
        return NULL;
    }
    ggn_trainer_keep(t);
    return t;
}

void ggn_trainer_destroy(struct ggn_trainer *t)
{
    if (!t)
        return;
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_destroy(t->weights[net]);
        free(t->grad[net]);
    }
    ggn_exec_destroy(t->r);
    ggn_exec_destroy(t->m);
    ggn_exec_destroy(t->m2);
    ggn_exec_destroy(t->d);
    ggn_ssim_destroy(t->ssim);
    free(t);
}

static double grad_l2(const struct ggn_trainer *t, int net, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += (double)t->grad[net][i] * (double)t->grad[net][i];
    return sqrt(sum);
}

static void zero_grad(struct ggn_trainer *t, int net) { memset(t->grad[net], 0, t->graph[net].n_params * sizeof(real)); }

/* Back to the last good state when a value is beyond what training can have, and says which tensor went wrong first. */
static int check(struct ggn_trainer *t, int net, double value, const char *what, struct base_err *err)
{
    const struct ggn_graph *g = &t->graph[net];
    const char *name = "none";
    double worst = -1;
    if (value <= t->options.explode)
        return 0;
    for (int i = g->n_tensors - 1; i >= 0; i--) {
        const struct ggn_tensor *p = &g->tensor[i];
        double sum = 0;
        for (size_t k = 0; k < p->count; k++) {
            double v = (double)t->grad[net][p->offset + k];
            sum += v * v;
        }
        if (!(sum <= worst)) { /* also takes a NaN */
            worst = isnan(sum) ? INFINITY : sum;
            name = p->name;
        }
    }
    roll_back(t);
    return base_fail(err, GGN_EDIVERGED, "training diverged: %s of the %s is %g, worst in %s; returned to step %llu", what,
                     g->name, value, name, (unsigned long long)t->steps);
}

/* Clips, takes one Adam step of the first n parameters (Kingma & Ba 2015, algorithm 1) and packs. */
static int update(struct ggn_trainer *t, int net, size_t n, struct base_err *err)
{
    const struct ggn_train_options *o = &t->options;
    double norm = grad_l2(t, net, n);
    int rc = check(t, net, norm, "gradient norm", err);
    if (rc)
        return rc;
    if (o->clip > 0 && norm > o->clip)
        for (size_t i = 0; i < n; i++)
            t->grad[net][i] *= (real)(o->clip / norm);
    double step = (double)++t->adam_t[net];
    double c1 = 1 / -expm1(step * log(o->beta1)), c2 = 1 / -expm1(step * log(o->beta2));
    t->weights[net]->kernels->adam(t->weights[net]->params, t->grad[net], t->adam_m[net], t->adam_v[net], (long)n,
                                   (real)o->lr[net], (real)o->beta1, (real)o->beta2, (real)c1, (real)c2, (real)o->eps);
    ggn_weights_pack(t->weights[net], t->threads);
    return 0;
}

/* Gap-free planes, from planes[i·stride] on, into the input of image step·i + first of the executor, i < count. */
static void set_inputs(const struct ggn_exec *e, int step, int first, const real *const *planes, int stride, int count)
{
    const struct ggn_value *v = &e->graph->value[0];
    for (int i = 0; i < count; i++)
        for (int c = 0; c < v->c; c++)
            ggn_exec_load(e, step * i + first, c, planes[(size_t)i * (size_t)stride + (size_t)c], v->w);
}

/* SSIM of R's answer to image i and its reference, of three planes; back: `share` of its gradient into R's output. */
static double denoised_ssim(struct ggn_trainer *t, int i, const real *const *reference, int back, double share)
{
    const int out = t->graph[GGN_NET_R].n_values - 1;
    const struct ggn_value *v = &t->graph[GGN_NET_R].value[out], *in = &t->graph[GGN_NET_R].value[0];
    const real *x[3], *y[3];
    real *dx[3];
    for (int c = 0; c < 3; c++) {
        /* the input's gradient is not needed: its planes hold the reference in the layout of the output */
        real *copy = ggn_exec_grad(t->r, 0, i, c);
        ggn_plane_copy(in, copy, reference[c], v->w);
        x[c] = ggn_exec_plane(t->r, out, i, c);
        dx[c] = ggn_exec_grad(t->r, out, i, c);
        y[c] = copy;
    }
    return ggn_ssim_mean(t->ssim, x, y, back ? dx : NULL, 3, v->row, share);
}

/* R on `count` images; *loss = mean of 1 − SSIM, whose gradient is left behind R's output. */
static int denoiser_forward(struct ggn_trainer *t, const real *const *x, int x_stride, const real *const *reference,
                            int count, double *loss, struct base_err *err)
{
    set_inputs(t->r, 1, 0, x, x_stride, count);
    ggn_exec_forward(t->r, t->weights[GGN_NET_R], count, GGN_TRAIN);
    double total = 0;
    for (int i = 0; i < count; i++)
        total += denoised_ssim(t, i, reference + 3 * i, 1, -1.0 / count);
    *loss = 1 - total / count;
    return check(t, GGN_NET_R, *loss, "loss", err);
}

/* R's gradient, into grad. */
static void denoiser_backward(struct ggn_trainer *t)
{
    zero_grad(t, GGN_NET_R);
    ggn_exec_backward(t->r, t->weights[GGN_NET_R], t->grad[GGN_NET_R]);
}

static int check_batch(const struct ggn_trainer *t, int count, int parts, struct base_err *err)
{
    if (count < 1 || count > t->options.batch)
        return base_fail(err, BASE_EINVAL, "a batch of %d is not in 1..%d", count, t->options.batch);
    if ((t->options.parts & parts) != parts)
        return base_fail(err, BASE_EINVAL, "this trainer was made without the networks of the step");
    return 0;
}

int ggn_trainer_denoiser_step(struct ggn_trainer *t, const real *const *x, const real *const *reference, int count,
                              double *loss, struct base_err *err)
{
    int rc = check_batch(t, count, GGN_TRAIN_R, err);
    if (!rc)
        rc = denoiser_forward(t, x, 3, reference, count, loss, err);
    if (rc)
        return rc;
    denoiser_backward(t);
    rc = update(t, GGN_NET_R, t->graph[GGN_NET_R].n_params, err);
    if (!rc)
        t->steps++;
    return rc;
}

void ggn_trainer_denoiser_losses(struct ggn_trainer *t, const real *const *x, const real *const *reference, int count,
                                 double *loss)
{
    set_inputs(t->r, 1, 0, x, 3, count);
    ggn_exec_forward(t->r, t->weights[GGN_NET_R], count, GGN_EVAL);
    for (int i = 0; i < count; i++)
        loss[i] = 1 - denoised_ssim(t, i, reference + 3 * i, 0, 0);
}

/* D's input (NFM of denoised, NFM of noisy) from generator outputs; or `back` with the gradients, which with `add` are added
 * to those of the maps: between two backward passes of D, M is the same, so that both can go back through it at once:
 * Jᵀg + Jᵀg' = Jᵀ(g + g'). */
static void exchange_maps(struct ggn_trainer *t, int count, int back, int add)
{
    const int out = t->graph[GGN_NET_M].n_values - 1;
    const struct ggn_value *v = &t->graph[GGN_NET_M].value[out];
    for (int i = 0; i < 2 * count; i++) {
        const int channel = i % 2, image = i / 2,
                  n = t->m2 ? image : i; /* in one batch a sample's windows lie side by side */
        const struct ggn_exec *m = channel && t->m2 ? t->m2 : t->m;
        if (!back) {
            ggn_exec_load(t->d, image, channel, ggn_exec_output(m, n, 0), v->row);
            continue;
        }
        real *to = ggn_exec_grad(m, out, n, 0), *from = ggn_exec_grad(t->d, 0, image, channel);
        if (!add)
            ggn_plane_copy(v, to, from, v->row);
        for (int y = 0; y < v->h && add; y++)
            m->kernels->axpy(to + (long)y * v->row, 1, from + (long)y * v->row, v->w);
    }
}

/* What D is given beside the maps: noise maps, each with a plane that says whether there is one, and scalars. */
static void set_measured(struct ggn_trainer *t, const struct ggn_batch *b)
{
    const struct ggn_value *v = &t->graph[GGN_NET_D].value[0];
    for (int i = 0; i < b->count && t->hyper.noise_map; i++) {
        real *noise_map = ggn_exec_plane(t->d, 0, i, 2), *flag = ggn_exec_plane(t->d, 0, i, 3);
        for (int y = 0; y < v->h; y++)
            for (int x = 0; x < v->w; x++) {
                noise_map[y * v->row + x] = b->noise_map[i] ? b->noise_map[i][y * v->w + x] : 0;
                flag[y * v->row + x] = b->noise_map[i] ? 1 : 0;
            }
    }
    for (int i = 0; i < b->count && t->hyper.scalars; i++)
        memcpy(ggn_exec_plane(t->d, GGN_D_SCALARS, i, 0), b->scalars[i], (size_t)t->hyper.scalars * sizeof *b->scalars[i]);
}

/* D's answer to image i of its last forward pass: its logit, or with hyper.reach octaves: law + the correction. */
static double answer(const struct ggn_trainer *t, int i, double law)
{
    double z = (double)*ggn_exec_output(t->d, i, 0);
    return t->hyper.reach > 0 ? law + ggn_residual_correction(z, t->hyper.reach) : z;
}

void ggn_trainer_answers(struct ggn_trainer *t, const struct ggn_batch *b, double *answers)
{
    for (int channel = 0; channel < 2; channel++) { /* one window after the other: preset paper has no room for both */
        set_inputs(t->m, 1, 0, channel ? b->noisy : b->denoised, 3 * t->hyper.window, b->count);
        ggn_exec_forward(t->m, t->weights[GGN_NET_M], b->count, GGN_EVAL);
        for (int i = 0; i < b->count; i++)
            ggn_exec_load(t->d, i, channel, ggn_exec_output(t->m, i, 0), ggn_graph_output(t->m->graph)->row);
    }
    set_measured(t, b);
    ggn_exec_forward(t->d, t->weights[GGN_NET_D], b->count, GGN_EVAL);
    for (int i = 0; i < b->count; i++)
        answers[i] = answer(t, i, t->hyper.reach > 0 ? b->law[i] : 0);
}

/* d logit / d network: 1, or of scale · (law + reach · tanh(z/reach)) scale · (1 − tanh²(z/reach)). */
static double slope_of(const struct ggn_trainer *t, int i)
{
    if (t->hyper.reach <= 0)
        return 1;
    double tame = answer(t, i, 0) / t->hyper.reach;
    return t->options.scale * (1 - tame * tame);
}

/* D forward, mean BCE, D backward (its own gradient is added to grad, that of the maps stays in d). */
static double classify(struct ggn_trainer *t, const struct ggn_batch *b, double *logits)
{
    const int out = t->graph[GGN_NET_D].n_values - 1;
    const double share = 1.0 / b->count;
    double each[GGN_BATCH_MAX], total = 0;
    double *z = logits ? logits : each;
    t->d->dropout_seed = ggn_hash((uint32_t)t->steps, ggn_hash((uint32_t)t->adam_t[GGN_NET_D], t->options.seed));
    ggn_exec_forward(t->d, t->weights[GGN_NET_D], b->count, GGN_TRAIN);
    for (int i = 0; i < b->count; i++) {
        z[i] = t->hyper.reach > 0 ? t->options.scale * answer(t, i, b->law[i]) : answer(t, i, 0);
        total += share * ggn_bce(z[i], b->label[i]);
        *ggn_exec_grad(t->d, out, i, 0) = (real)(share * slope_of(t, i) * ggn_bce_grad(z[i], b->label[i]));
    }
    ggn_exec_backward(t->d, t->weights[GGN_NET_D], t->grad[GGN_NET_D]);
    return total;
}

int ggn_trainer_classifier_step(struct ggn_trainer *t, const struct ggn_batch *b, double *bce, double *logits,
                                struct base_err *err)
{
    const int planes = 3 * t->hyper.window;
    int rc = check_batch(t, b->count, GGN_TRAIN_MD, err);
    if (rc)
        return rc;
    if (t->hyper.preset == GGN_PRESET_PAPER)
        return base_fail(err, BASE_EINVAL, "the published preset trains in its own order");
    set_inputs(t->m, 2, 0, b->denoised, planes, b->count);
    set_inputs(t->m, 2, 1, b->noisy, planes, b->count);
    zero_grad(t, GGN_NET_M);
    zero_grad(t, GGN_NET_D);
    ggn_exec_forward(t->m, t->weights[GGN_NET_M], 2 * b->count, GGN_TRAIN);
    exchange_maps(t, b->count, 0, 0);
    set_measured(t, b);
    *bce = classify(t, b, logits);
    rc = check(t, GGN_NET_D, *bce, "loss", err);
    if (rc)
        return rc;
    exchange_maps(t, b->count, 1, 0);
    ggn_exec_backward(t->m, t->weights[GGN_NET_M], t->grad[GGN_NET_M]);
    rc = update(t, GGN_NET_D, t->graph[GGN_NET_D].n_params, err);
    if (!rc)
        rc = update(t, GGN_NET_M, t->graph[GGN_NET_M].n_params, err);
    if (!rc)
        t->steps++;
    return rc;
}

/* Step 1 of the published order: R on each image of the windows, with a step of Adam; its output is kept as the generator's
 * denoised input. */
static int paper_denoise(struct ggn_trainer *t, const struct ggn_batch *b, struct ggn_paper_record *record,
                         struct base_err *err)
{
    const struct ggn_graph *r = &t->graph[GGN_NET_R];
    for (int k = 0; k < t->hyper.window; k++) {
        int rc = denoiser_forward(t, b->noisy + 3 * k, 3 * t->hyper.window, b->reference, b->count,
                                  &record->denoiser_loss[k], err);
        if (rc)
            return rc;
        denoiser_backward(t);
        if (k == 0)
            record->denoiser_grad_l2 = grad_l2(t, GGN_NET_R, r->n_params);
        rc = update(t, GGN_NET_R, r->n_params, err);
        if (rc)
            return rc;
        for (int i = 0; i < b->count; i++)
            for (int c = 0; c < 3; c++)
                ggn_exec_load(t->m, i, 3 * k + c, ggn_exec_output(t->r, i, c), ggn_graph_output(r)->row);
    }
    return 0;
}

int ggn_trainer_paper_step(struct ggn_trainer *t, const struct ggn_batch *b, struct ggn_paper_record *record,
                           struct base_err *err)
{
    const struct ggn_graph *m = &t->graph[GGN_NET_M], *d = &t->graph[GGN_NET_D];
    const size_t m_trained = m->tensor[m->n_tensors - 2].offset; /* all but the last convolution's weight and bias */
    const int record_all = b->count <= 64;
    int rc = check_batch(t, b->count, GGN_TRAIN_ALL, err);
    if (rc)
        return rc;
    if (t->hyper.preset != GGN_PRESET_PAPER)
        return base_fail(err, BASE_EINVAL, "the published order needs the preset paper");
    rc = paper_denoise(t, b, record, err);
    if (rc)
        return rc;

    zero_grad(t, GGN_NET_M);
    zero_grad(t, GGN_NET_D);
    set_inputs(t->m2, 1, 0, b->noisy, 3 * t->hyper.window, b->count);
    ggn_exec_forward(t->m, t->weights[GGN_NET_M], b->count, GGN_TRAIN);
    ggn_exec_forward(t->m2, t->weights[GGN_NET_M], b->count, GGN_TRAIN);
    exchange_maps(t, b->count, 0, 0);

    record->bce_before = classify(t, b, record_all ? record->logit_before : NULL);
    rc = check(t, GGN_NET_D, record->bce_before, "loss", err);
    if (rc)
        return rc;
    exchange_maps(t, b->count, 1, 0);
    record->d_grad_l2 = grad_l2(t, GGN_NET_D, d->n_params);
    rc = update(t, GGN_NET_D, d->n_params, err);
    if (rc)
        return rc;

    zero_grad(t, GGN_NET_D);
    record->bce_after = classify(t, b, record_all ? record->logit_after : NULL);
    exchange_maps(t, b->count, 1, 1);
    ggn_exec_backward(t->m, t->weights[GGN_NET_M], t->grad[GGN_NET_M]);
    ggn_exec_backward(t->m2, t->weights[GGN_NET_M], t->grad[GGN_NET_M]);
    record->m_grad_l2_accumulated = grad_l2(t, GGN_NET_M, m_trained);
    rc = update(t, GGN_NET_M, m_trained, err);
    if (!rc)
        t->steps++;
    return rc;
}
