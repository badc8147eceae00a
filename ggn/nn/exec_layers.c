/* The layers beside convolutions. */
#include <math.h>
#include <string.h>

#include "nn/hash.h"
#include "nn/layers.h"
#include "nn/real.h"

/* The two sums of image n and channel c. */
static double *bn_sums_of(const struct ggn_task *t, int n, int c)
{
    return t->e->sums + 2 * ((size_t)(n + 1) * (size_t)ggn_task_out(t)->c + (size_t)c);
}

/* One of the two, 0 or 1, over the whole batch [channels]. */
static double *bn_total(const struct ggn_task *t, int k) { return t->e->sums + (size_t)k * (size_t)ggn_task_out(t)->c; }

/* Mean of one channel of one image, and the sum of squares around it. */
static void bn_image(const struct ggn_task *t, long i)
{
    const struct ggn_value *v = ggn_task_out(t);
    const int n = (int)(i / v->c), c = (int)(i % v->c);
    const real *x = ggn_exec_plane(t->e, t->l->in, n, c);
    double *sums = bn_sums_of(t, n, c);
    sums[0] = t->e->kernels->sum(x, v->h, v->w, v->row) / ((double)v->h * v->w);
    sums[1] = t->e->kernels->sum_sq(x, sums[0], v->h, v->w, v->row);
}

/* Batch statistics from those of the images (Chan, Golub & LeVeque 1979): sums of means and of squares around the mean. */
static void bn_combine(const struct ggn_task *t)
{
    const struct ggn_value *v = ggn_task_out(t);
    const double pixels = (double)v->h * v->w;
    double *means = bn_total(t, 0), *squares = bn_total(t, 1);
    memset(t->e->sums, 0, 2 * (size_t)v->c * sizeof *means);
    for (int n = 0; n < t->e->batch; n++)
        for (int c = 0; c < v->c; c++)
            means[c] += bn_sums_of(t, n, c)[0];
    for (int n = 0; n < t->e->batch; n++)
        for (int c = 0; c < v->c; c++) {
            const double *image = bn_sums_of(t, n, c), off = image[0] - means[c] / t->e->batch;
            squares[c] += image[1] + pixels * off * off;
        }
}

/* Of channel c: biased variance to normalise, unbiased for the running estimate. */
static void bn_statistics(const struct ggn_task *t, long c)
{
    const struct ggn_value *v = ggn_task_out(t);
    const size_t s = t->l->stats + (size_t)c;
    const double count = (double)v->h * v->w * t->e->batch;
    const double mean = bn_total(t, 0)[c] / t->e->batch, var = bn_total(t, 1)[c] / count;
    t->e->bn_mean[s] = (real)mean;
    t->e->bn_inv[s] = (real)(1 / sqrt(var + GGN_BN_EPS));
    double unbiased = count > 1 ? var * count / (count - 1) : var;
    t->w->mean[s] = (real)((1 - GGN_BN_MOMENTUM) * (double)t->w->mean[s] + GGN_BN_MOMENTUM * mean);
    t->w->var[s] = (real)((1 - GGN_BN_MOMENTUM) * (double)t->w->var[s] + GGN_BN_MOMENTUM * unbiased);
}

static void bn_channel(const struct ggn_task *t, long c)
{
    const struct ggn_value *v = ggn_task_out(t);
    const size_t s = t->l->stats + (size_t)c;
    real scale = t->w->scale[s], shift = t->w->shift[s];
    if (t->e->mode == GGN_TRAIN) {
        bn_statistics(t, c);
        scale = t->w->params[t->l->weight + (size_t)c] * t->e->bn_inv[s];
        shift = t->w->params[t->l->bias + (size_t)c] - t->e->bn_mean[s] * scale;
    } else {
        t->e->bn_mean[s] = t->w->mean[s];
        t->e->bn_inv[s] = (real)(1 / sqrt((double)t->w->var[s] + GGN_BN_EPS));
    }
    for (int n = 0; n < t->e->batch; n++)
        t->e->kernels->affine(ggn_exec_plane(t->e, t->l->out, n, (int)c), ggn_exec_plane(t->e, t->l->in, n, (int)c), scale,
                              shift, v->h, v->w, v->row);
}

static void bn_forward(struct ggn_task *t)
{
    const int channels = ggn_task_out(t)->c;
    if (t->e->mode == GGN_TRAIN) {
        ggn_task_run(t, (long)t->e->batch * channels, bn_image);
        bn_combine(t);
    }
    ggn_task_run(t, channels, bn_channel);
}

/* x̂ = (x − μ)·inv. dγ = Σ dY·x̂, dβ = Σ dY, dX = γ·inv·(dY − mean(dY) − x̂·mean(dY·x̂)); with running statistics the two
 * means are constants of the pass and dX = γ·inv·dY. */
static void bn_back_image(const struct ggn_task *t, long i)
{
    const struct ggn_value *v = ggn_task_out(t);
    const int n = (int)(i / v->c), c = (int)(i % v->c);
    t->e->kernels->bn_sums(bn_sums_of(t, n, c), ggn_exec_grad(t->e, t->l->out, n, c), ggn_exec_plane(t->e, t->l->in, n, c),
                           t->e->bn_mean[t->l->stats + (size_t)c], v->h, v->w, v->row);
}

static void bn_back_channel(const struct ggn_task *t, long c)
{
    const struct ggn_value *v = ggn_task_out(t);
    const size_t s = t->l->stats + (size_t)c;
    const double count = (double)v->h * v->w * t->e->batch;
    const double inv = (double)t->e->bn_inv[s], mean = (double)t->e->bn_mean[s];
    const double gamma = (double)t->w->params[t->l->weight + (size_t)c];
    const double sum[2] = {bn_total(t, 0)[c], bn_total(t, 1)[c]};
    t->e->params_grad[t->l->weight + (size_t)c] += (real)(sum[1] * inv);
    t->e->params_grad[t->l->bias + (size_t)c] += (real)sum[0];
    double b = t->e->mode == GGN_TRAIN ? -gamma * inv * inv * inv * sum[1] / count : 0;
    double shift = t->e->mode == GGN_TRAIN ? -gamma * inv * sum[0] / count - b * mean : 0;
    for (int n = 0; n < t->e->batch; n++)
        t->e->kernels->bn_grad(ggn_exec_grad(t->e, t->l->in, n, (int)c), ggn_exec_grad(t->e, t->l->out, n, (int)c),
                               ggn_exec_plane(t->e, t->l->in, n, (int)c), (real)(gamma * inv), (real)b, (real)shift,
                               t->l->add_in, v->h, v->w, v->row);
}

static void bn_backward(struct ggn_task *t)
{
    const int channels = ggn_task_out(t)->c;
    ggn_task_run(t, (long)t->e->batch * channels, bn_back_image);
    memset(t->e->sums, 0, 2 * (size_t)channels * sizeof *t->e->sums);
    for (int n = 0; n < t->e->batch; n++)
        for (int c = 0; c < channels; c++)
            for (int k = 0; k < 2; k++)
                bn_total(t, k)[c] += bn_sums_of(t, n, c)[k];
    ggn_task_run(t, channels, bn_back_channel);
}

const struct ggn_layer_passes GGN_LAYER(bn) = {bn_forward, bn_backward};

/* The planes of task i. */
struct pair {
    const struct ggn_value *in, *out;
    real *x, *y, *dx, *dy;
    long n;
    int c;
};

static struct pair pair_of(const struct ggn_task *t, long i)
{
    struct pair p = {.in = ggn_task_in(t), .out = ggn_task_out(t)};
    p.n = i / p.in->c;
    p.c = (int)(i % p.in->c);
    int c_out = p.c % p.out->c; /* FLATTEN has its own loop */
    p.x = ggn_exec_plane(t->e, t->l->in, p.n, p.c);
    p.y = ggn_exec_plane(t->e, t->l->out, p.n, c_out);
    if (t->e->grads) {
        p.dx = ggn_exec_grad(t->e, t->l->in, p.n, p.c);
        p.dy = ggn_exec_grad(t->e, t->l->out, p.n, c_out);
    }
    return p;
}

/* A layer of one task per image and channel of the input. */
#define PLANE_LAYER(name, forward, backward) \
    PLANE_PASS(name##_forward, forward) \
    PLANE_PASS(name##_backward, backward) \
    const struct ggn_layer_passes GGN_LAYER(name) = {name##_forward, name##_backward};

#define PLANE_PASS(name, body) \
    static void name##_plane(const struct ggn_task *t, long i) \
    { \
        const struct ggn_kernels *k = t->e->kernels; \
        struct pair p = pair_of(t, i); \
        body; \
        (void)k; \
    } \
    static void name(struct ggn_task *t) { ggn_task_run(t, (long)t->e->batch *ggn_task_in(t)->c, name##_plane); }

PLANE_LAYER(lrelu, k->lrelu(p.y, p.x, (real)t->l->slope, p.in->h, p.in->w, p.in->row),
            k->lrelu_grad(p.dx, p.dy, p.y, (real)t->l->slope, t->l->add_in, p.in->h, p.in->w, p.in->row))
PLANE_LAYER(sigmoid, k->sigmoid(p.y, p.x, p.in->h, p.in->w, p.in->row),
            k->sigmoid_grad(p.dx, p.dy, p.y, t->l->add_in, p.in->h, p.in->w, p.in->row))
static void up_plane(const struct ggn_task *t, const struct pair *p)
{
    if (t->l->pad_y)
        memset(p->y, 0, (size_t)p->out->w * sizeof *p->y);
    for (int r = 0; r < p->out->h && t->l->pad_x; r++)
        p->y[(long)r * p->out->row] = 0;
    t->e->kernels->up(p->y + t->l->pad_y * p->out->row + t->l->pad_x, p->x, p->in->h, p->in->w, p->out->row, p->in->row);
}

PLANE_LAYER(up, up_plane(t, &p),
            k->up_grad(p.dx, p.dy + t->l->pad_y * p.out->row + t->l->pad_x, t->l->add_in, p.in->h, p.in->w, p.out->row,
                       p.in->row))

/* Window of output (r, s) of the 3×3 stride 2 pad 1 pool: rows [2r−1, 2r+1] inside the picture. The first largest element in
 * row order counts. */
static long pool3_argmax(const struct ggn_value *in, const real *x, int r, int s)
{
    long best = -1;
    for (int y = 2 * r > 0 ? 2 * r - 1 : 0; y <= 2 * r + 1 && y < in->h; y++)
        for (int q = 2 * s > 0 ? 2 * s - 1 : 0; q <= 2 * s + 1 && q < in->w; q++) {
            long at = (long)y * in->row + q;
            if (best < 0 || x[at] > x[best] || isnan(x[at]))
                best = at;
        }
    return best;
}

/* One output row: the largest of each column first (outside rows repeat inside ones), then of the neighbouring columns. */
static void pool3_row(const struct pair *p, int r)
{
    const struct ggn_value *in = p->in;
    const real *b = p->x + 2L * r * in->row, *a = r > 0 ? b - in->row : b, *c = 2 * r + 1 < in->h ? b + in->row : b;
    real column[GGN_MAX_SIDE], *y = p->y + (long)r * p->out->row;
    for (int i = 0; i < in->w; i++)
        column[i] = ggn_larger(ggn_larger(a[i], b[i]), c[i]);
    for (int s = 0; s < p->out->w; s++) {
        real left = column[s > 0 ? 2 * s - 1 : 0], mid = column[2 * s],
             right = column[2 * s + 1 < in->w ? 2 * s + 1 : 2 * s];
        y[s] = ggn_larger(ggn_larger(left, mid), right);
    }
}

static void pool_plane(const struct ggn_task *t, const struct pair *p)
{
    if (t->l->kernel == 2) {
        t->e->kernels->maxpool2(p->y, p->x, p->out->h, p->out->w, p->out->row, p->in->row);
        return;
    }
    for (int r = 0; r < p->out->h; r++)
        pool3_row(p, r);
}

static void pool_back_plane(const struct ggn_task *t, const struct pair *p)
{
    if (t->l->kernel == 2) {
        t->e->kernels->maxpool2_grad(p->dx, p->dy, p->x, p->y, t->l->add_in, p->in->h, p->in->w, p->out->row, p->in->row);
        return;
    }
    for (int r = 0; r < p->in->h && !t->l->add_in; r++)
        memset(p->dx + (long)r * p->in->row, 0, (size_t)p->in->w * sizeof *p->dx);
    for (int r = 0; r < p->out->h; r++)
        for (int s = 0; s < p->out->w; s++)
            p->dx[pool3_argmax(p->in, p->x, r, s)] += p->dy[r * p->out->row + s];
}

PLANE_LAYER(maxpool, pool_plane(t, &p), pool_back_plane(t, &p))

static void flatten_plane(const struct ggn_task *t, const struct pair *p, int back)
{
    real *flat = ggn_exec_at(t->e, back ? t->e->grads : t->e->acts, t->l->out, p->n, p->c * p->in->h * p->in->w);
    for (int r = 0; r < p->in->h; r++, flat += p->in->w)
        for (int s = 0; s < p->in->w; s++) {
            if (back)
                p->dx[r * p->in->row + s] = (t->l->add_in ? p->dx[r * p->in->row + s] : 0) + flat[s];
            else
                flat[s] = p->x[r * p->in->row + s];
        }
}

PLANE_LAYER(flatten, flatten_plane(t, &p, 0), flatten_plane(t, &p, 1))

/* 0 or 1/(1 − drop), a function of the seed, the layer, the image of the batch and the element. */
static real dropout_factor(const struct ggn_task *t, long i)
{
    if (t->e->mode == GGN_EVAL || (t->e->flags & GGN_EXEC_NO_DROPOUT))
        return 1;
    uint32_t layer = (uint32_t)(t->l - t->e->graph->layer);
    return ggn_hash_unit((uint32_t)i, ggn_hash(layer, t->e->dropout_seed)) < t->l->drop ? 0 : (real)(1 / (1 - t->l->drop));
}

PLANE_LAYER(dropout, *p.y = *p.x * dropout_factor(t, i), *p.dx = (t->l->add_in ? *p.dx : 0) + *p.dy * dropout_factor(t, i))

/* Linear: Y = W·X + b, X the vector `in` and behind it that of `in2`. */

static void linear_unit(const struct ggn_task *t, long o)
{
    const long c_in = ggn_task_in(t)->c, c_all = ggn_task_c_in(t);
    const real *w = t->w->params + t->l->weight + (size_t)(o * c_all);
    for (int n = 0; n < t->e->batch; n++) {
        real *y = &ggn_exec_plane(t->e, t->l->out, n, 0)[o];
        *y = t->w->params[t->l->bias + (size_t)o] + t->e->kernels->dot(w, ggn_exec_plane(t->e, t->l->in, n, 0), c_in);
        if (t->l->in2 >= 0)
            *y += t->e->kernels->dot(w + c_in, ggn_exec_plane(t->e, t->l->in2, n, 0), c_all - c_in);
    }
}

static void linear_forward(struct ggn_task *t) { ggn_task_run(t, ggn_task_out(t)->c, linear_unit); }

/* dW[o] += Σ_n dY[n][o]·X[n], db[o] += Σ_n dY[n][o] */
static void linear_weight_back(const struct ggn_task *t, long o)
{
    const long c_in = ggn_task_in(t)->c, c_all = ggn_task_c_in(t);
    real *dw = t->e->params_grad + t->l->weight + (size_t)(o * c_all);
    for (int n = 0; n < t->e->batch; n++) {
        const real d = ggn_exec_grad(t->e, t->l->out, n, 0)[o];
        t->e->kernels->axpy(dw, d, ggn_exec_plane(t->e, t->l->in, n, 0), c_in);
        if (t->l->in2 >= 0)
            t->e->kernels->axpy(dw + c_in, d, ggn_exec_plane(t->e, t->l->in2, n, 0), c_all - c_in);
        t->e->params_grad[t->l->bias + (size_t)o] += d;
    }
}

/* dX = Wᵀ·dY for the inputs from `first` on that value `in` holds. */
static void linear_value_back(const struct ggn_task *t, long n, int in, long first, int add)
{
    const struct ggn_graph *g = t->e->graph;
    const long c_in = g->value[in].c, c_all = ggn_task_c_in(t);
    real *dx = ggn_exec_grad(t->e, in, n, 0);
    if (!add)
        memset(dx, 0, (size_t)c_in * sizeof *dx);
    for (int o = 0; o < ggn_task_out(t)->c; o++)
        t->e->kernels->axpy(dx, ggn_exec_grad(t->e, t->l->out, n, 0)[o],
                            t->w->params + t->l->weight + (size_t)(o * c_all + first), c_in);
}

static void linear_input_back(const struct ggn_task *t, long n)
{

    linear_value_back(t, n, t->l->in, 0, t->l->add_in);
    if (t->l->in2 >= 0)
        linear_value_back(t, n, t->l->in2, ggn_task_in(t)->c, t->l->add_in2);
}

static void linear_backward(struct ggn_task *t)
{
    ggn_task_run(t, ggn_task_out(t)->c, linear_weight_back);
    ggn_task_run(t, t->e->batch, linear_input_back);
}

const struct ggn_layer_passes GGN_LAYER(linear) = {linear_forward, linear_backward};
