#include "baselines/lstm.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "baselines/blas.h"
#include "nn/hash.h"
#include "nn/loss.h"

enum { LAYERS = 3, BATCH = 64 };
static const int widths[LAYERS] = {512, 128, 32};
static const float dropout = 0.4f;

struct layer {
    int in, out;
    size_t w, u, b; /* offsets in the parameters: W [4·out, in], U [4·out, out], b [4·out]; gates in the order i, f, g, o */
    float *z;       /* [steps][batch][4·out]: gates after their activation; then d loss / d pre-activation */
    float *c, *s, *h; /* [steps][batch][out]: cell, sigmoid(cell), output (before dropout) */
    float *x;         /* [steps][batch][in]: what came in (after dropout) */
    float *dx;        /* the same shape: d loss / d x */
    float *mask;      /* [steps][batch][out]: dropout of the output, 0 or 1/(1-p) */
};

struct ggn_lstm {
    int inputs, steps, batch; /* batch: sequences at a time, 1 or BATCH */
    uint32_t seed, calls;
    size_t n, dense; /* parameters; offset of the last unit's [32] weights and bias */
    long adam_steps;
    float *owned; /* p, grad, m, v, [n] each; NULL: a reader, whose p is borrowed and that has no others */
    const float *p;
    float *grad, *m, *v;
    float *activations; /* owns what the layers point to */
    float *dh, *dc;     /* [batch][512] scratch of the backward pass */
    struct layer layers[LAYERS];
};

static float sigmoid(float x) { return 1.0f / (1.0f + expf(-x)); }

static float hard_sigmoid(float x)
{
    float y = 0.2f * x + 0.5f;
    return y < 0.0f ? 0.0f : y > 1.0f ? 1.0f : y;
}

/* Glorot & Bengio 2010, of n weights between so many inputs and outputs. */
static void draw_weights(float *p, size_t n, int inputs, int outputs, uint32_t seed)
{
    const float limit = sqrtf(6.0f / (float)(inputs + outputs));
    for (size_t i = 0; i < n; i++)
        p[i] = limit * (2.0f * (float)ggn_hash_unit((uint32_t)i, seed) - 1.0f);
}

void ggn_lstm_destroy(struct ggn_lstm *l)
{
    if (!l)
        return;
    free(l->owned);
    free(l->activations);
    free(l);
}

/* Lays out the parameters; returns how many there are. */
static size_t lay_out(struct ggn_lstm *l, int inputs)
{
    l->inputs = inputs;
    l->n = 0;
    for (int k = 0; k < LAYERS; k++) {
        struct layer *y = &l->layers[k];
        y->in = k == 0 ? inputs : widths[k - 1];
        y->out = widths[k];
        y->w = l->n;
        y->u = y->w + 4 * (size_t)y->out * (size_t)y->in;
        y->b = y->u + 4 * (size_t)y->out * (size_t)y->out;
        l->n = y->b + 4 * (size_t)y->out;
    }
    l->dense = l->n;
    return l->n += (size_t)widths[LAYERS - 1] + 1;
}

size_t ggn_lstm_parameters(int inputs)
{
    struct ggn_lstm l;
    return lay_out(&l, inputs);
}

/* Shares out one allocation among the layers. */
static void place_activations(struct ggn_lstm *l)
{
    size_t batch = (size_t)l->batch, rows = (size_t)l->steps * batch;
    float *at = l->activations;
    l->dh = at;
    l->dc = at + batch * (size_t)widths[0];
    at += 2 * batch * (size_t)widths[0];
    for (int k = 0; k < LAYERS; k++) {
        struct layer *y = &l->layers[k];
        size_t out = rows * (size_t)y->out, in = rows * (size_t)y->in;
        y->z = at;
        y->c = y->z + 4 * out;
        y->s = y->c + out;
        y->h = y->s + out;
        y->mask = y->h + out;
        y->x = y->mask + out;
        y->dx = y->x + in;
        at = y->dx + in;
    }
}

/* weights NULL: for training, with parameters of its own. */
static struct ggn_lstm *create(int inputs, int steps, int batch, const float *weights, struct base_err *err)
{
    if (ggn_blas_open(err) != 0)
        return NULL;
    struct ggn_lstm *l = calloc(1, sizeof *l);
    if (l) {
        lay_out(l, inputs);
        l->steps = steps;
        l->batch = batch;
        size_t floats = 2 * (size_t)batch * (size_t)widths[0];
        for (int k = 0; k < LAYERS; k++)
            floats += (size_t)steps * (size_t)batch * (size_t)(8 * l->layers[k].out + 2 * l->layers[k].in);
        l->owned = weights ? NULL : calloc(4 * l->n, sizeof *l->owned);
        l->activations = calloc(floats, sizeof *l->activations);
    }
    if (!l || (!weights && !l->owned) || !l->activations) {
        base_fail_nomem(err, "LSTM");
        ggn_lstm_destroy(l);
        return NULL;
    }
    l->p = weights ? weights : l->owned;
    if (!weights) {
        l->grad = l->owned + l->n;
        l->m = l->grad + l->n;
        l->v = l->m + l->n;
    }
    place_activations(l);
    return l;
}

struct ggn_lstm *ggn_lstm_create(int inputs, int steps, uint32_t seed, struct base_err *err)
{
    struct ggn_lstm *l = create(inputs, steps, BATCH, NULL, err);
    if (!l)
        return NULL;
    float *p = l->owned;
    l->seed = seed;
    for (int k = 0; k < LAYERS; k++) {
        const struct layer *y = &l->layers[k];
        draw_weights(p + y->w, y->u - y->w, y->in, 4 * y->out, seed + 10 * (uint32_t)k);
        draw_weights(p + y->u, y->b - y->u, y->out, 4 * y->out, seed + 10 * (uint32_t)k + 1);
        for (int i = 0; i < y->out; i++) /* forget gates start open, as the published code's library has it */
            p[y->b + (size_t)(y->out + i)] = 1.0f;
    }
    draw_weights(p + l->dense, (size_t)widths[LAYERS - 1], widths[LAYERS - 1], 1, seed + 99);
    return l;
}

struct ggn_lstm *ggn_lstm_reader(int inputs, int steps, const float *weights, struct base_err *err)
{
    return create(inputs, steps, 1, weights, err);
}

float *ggn_lstm_weights(struct ggn_lstm *l) { return l->owned; }

/* Z = X·Wᵀ + H₋·Uᵀ + b; i, f, o = hard sigmoid, g = sigmoid; c = f∘c₋ + i∘g; h = o∘sigmoid(c). */
static void forward_step(const struct ggn_lstm *l, const struct layer *y, int t, int batch)
{
    const int out = y->out;
    const size_t step = (size_t)l->batch * (size_t)out, first = (size_t)t * step;
    float *z = y->z + 4 * first;
    const float *x = y->x + (size_t)t * (size_t)l->batch * (size_t)y->in;
    for (int r = 0; r < batch; r++)
        memcpy(z + (size_t)r * 4 * (size_t)out, l->p + y->b, 4 * (size_t)out * sizeof *z);
    ggn_blas_sgemm(CblasNoTrans, CblasTrans, batch, 4 * out, y->in, x, l->p + y->w, 1.0f, z);
    if (t > 0)
        ggn_blas_sgemm(CblasNoTrans, CblasTrans, batch, 4 * out, out, y->h + first - step, l->p + y->u, 1.0f, z);
    for (int r = 0; r < batch; r++)
        for (int k = 0; k < out; k++) {
            float *g = z + (size_t)r * 4 * (size_t)out + (size_t)k;
            size_t at = first + (size_t)r * (size_t)out + (size_t)k;
            float before = t > 0 ? y->c[at - step] : 0.0f;
            g[0] = hard_sigmoid(g[0]);
            g[out] = hard_sigmoid(g[out]);
            g[2 * out] = sigmoid(g[2 * out]);
            g[3 * out] = hard_sigmoid(g[3 * out]);
            y->c[at] = g[out] * before + g[0] * g[2 * out];
            y->s[at] = sigmoid(y->c[at]);
            y->h[at] = g[3 * out] * y->s[at];
        }
}

/* Logits of a batch whose inputs lie in layers[0].x. training: draws dropout masks. */
static void forward(struct ggn_lstm *l, int batch, int training, float *logit)
{
    for (int k = 0; k < LAYERS; k++) {
        const struct layer *y = &l->layers[k];
        size_t n = (size_t)l->steps * (size_t)l->batch * (size_t)y->out;
        for (int t = 0; t < l->steps; t++)
            forward_step(l, y, t, batch);
        l->calls += training != 0;
        for (size_t i = 0; i < n; i++)
            y->mask[i] = !training                                                                ? 1.0f
                         : (float)ggn_hash_unit((uint32_t)i, l->seed + 1000 + l->calls) < dropout ? 0.0f
                                                                                                  : 1.0f / (1.0f - dropout);
        for (size_t i = 0; i < n && k + 1 < LAYERS; i++)
            l->layers[k + 1].x[i] = y->h[i] * y->mask[i];
    }
    const struct layer *last = &l->layers[LAYERS - 1];
    for (int r = 0; r < batch; r++) {
        size_t at = ((size_t)(l->steps - 1) * (size_t)l->batch + (size_t)r) * (size_t)last->out;
        logit[r] = l->p[l->dense + (size_t)last->out];
        for (int k = 0; k < last->out; k++)
            logit[r] += l->p[l->dense + (size_t)k] * last->h[at + (size_t)k] * last->mask[at + (size_t)k];
    }
}

/* Slope of the hard sigmoid from its value: flat at both ends. */
static float hard_slope(float y) { return y > 0.0f && y < 1.0f ? 0.2f : 0.0f; }

/* One step back: dh (in l->dh) and dc (in l->dc) come from step t+1 and leave for t-1; z becomes d loss / d pre-activation.
 * */
static void backward_step(struct ggn_lstm *l, struct layer *y, int t, int batch)
{
    const int out = y->out;
    const size_t step = (size_t)l->batch * (size_t)out, first = (size_t)t * step;
    float *z = y->z + 4 * first;
    for (int r = 0; r < batch; r++)
        for (int k = 0; k < out; k++) {
            float *g = z + (size_t)r * 4 * (size_t)out + (size_t)k;
            size_t rk = (size_t)r * (size_t)out + (size_t)k, at = first + rk;
            float before = t > 0 ? y->c[at - step] : 0.0f;
            float i = g[0], f = g[out], c = g[2 * out], o = g[3 * out], s = y->s[at];
            float dh = l->dh[rk], dc = l->dc[rk] + dh * o * s * (1.0f - s);
            g[0] = dc * c * hard_slope(i);
            g[out] = dc * before * hard_slope(f);
            g[2 * out] = dc * i * c * (1.0f - c);
            g[3 * out] = dh * s * hard_slope(o);
            l->dc[rk] = dc * f;
        }
    const size_t inputs = (size_t)t * (size_t)l->batch * (size_t)y->in; /* of the steps before */
    /* dW += dZᵀ·X, dU += dZᵀ·H₋, dX = dZ·W, dH₋ = dZ·U */
    ggn_blas_sgemm(CblasTrans, CblasNoTrans, 4 * out, y->in, batch, z, y->x + inputs, 1.0f, l->grad + y->w);
    ggn_blas_sgemm(CblasNoTrans, CblasNoTrans, batch, y->in, 4 * out, z, l->p + y->w, 0.0f, y->dx + inputs);
    for (int r = 0; r < batch; r++)
        for (int k = 0; k < 4 * out; k++)
            l->grad[y->b + (size_t)k] += z[(size_t)r * 4 * (size_t)out + (size_t)k];
    if (t == 0)
        return;
    ggn_blas_sgemm(CblasTrans, CblasNoTrans, 4 * out, out, batch, z, y->h + first - step, 1.0f, l->grad + y->u);
    ggn_blas_sgemm(CblasNoTrans, CblasNoTrans, batch, out, 4 * out, z, l->p + y->u, 0.0f, l->dh);
}

/* Gradients of the sum over the batch of d[r]·logit[r]. */
static void backward(struct ggn_lstm *l, int batch, const float *d)
{
    memset(l->grad, 0, l->n * sizeof *l->grad);
    struct layer *last = &l->layers[LAYERS - 1];
    for (int layer = LAYERS - 1; layer >= 0; layer--) {
        struct layer *y = &l->layers[layer];
        size_t out = (size_t)y->out;
        memset(l->dh, 0, (size_t)batch * out * sizeof *l->dh);
        memset(l->dc, 0, (size_t)batch * out * sizeof *l->dc);
        for (int t = l->steps - 1; t >= 0; t--) {
            size_t first = (size_t)t * (size_t)l->batch * out;
            for (size_t i = 0; i < (size_t)batch * out; i++) {
                if (layer + 1 < LAYERS) /* what the layer above asks for */
                    l->dh[i] += l->layers[layer + 1].dx[first + i] * y->mask[first + i];
                else if (t == l->steps - 1)
                    l->dh[i] += d[i / out] * l->p[l->dense + i % out] * y->mask[first + i];
            }
            backward_step(l, y, t, batch);
        }
    }
    for (int r = 0; r < batch; r++) {
        size_t at = ((size_t)(l->steps - 1) * (size_t)l->batch + (size_t)r) * (size_t)last->out;
        for (int k = 0; k < last->out; k++)
            l->grad[l->dense + (size_t)k] += d[r] * last->h[at + (size_t)k] * last->mask[at + (size_t)k];
        l->grad[l->dense + (size_t)last->out] += d[r];
    }
}

static void load_step(struct ggn_lstm *l, int r, int t, const double *inputs)
{
    float *to = l->layers[0].x + ((size_t)t * (size_t)l->batch + (size_t)r) * (size_t)l->inputs;
    for (int k = 0; k < l->inputs; k++)
        to[k] = (float)inputs[k];
}

static void load_sequence(struct ggn_lstm *l, int r, const double *sequence)
{
    for (int t = 0; t < l->steps; t++)
        load_step(l, r, t, sequence + (size_t)t * (size_t)l->inputs);
}

/* Kingma & Ba 2015, lr 1e-3. */
static void adam(struct ggn_lstm *l)
{
    const float b1 = 0.9f, b2 = 0.999f;
    double step = (double)++l->adam_steps;
    float rate = (float)(1e-3 * sqrt(1.0 - pow(0.999, step)) / (1.0 - pow(0.9, step)));
    for (size_t i = 0; i < l->n; i++) {
        l->m[i] = b1 * l->m[i] + (1.0f - b1) * l->grad[i];
        l->v[i] = b2 * l->v[i] + (1.0f - b2) * l->grad[i] * l->grad[i];
        l->owned[i] -= rate * l->m[i] / (sqrtf(l->v[i]) + 1e-7f);
    }
}

double ggn_lstm_epoch(struct ggn_lstm *l, const double *const *sequences, const unsigned char *label, size_t n,
                      uint32_t epoch)
{
    float logit[BATCH], d[BATCH];
    double loss = 0.0, positive = 0.0;
    size_t *order = malloc((n > 0 ? n : 1) * sizeof *order);
    if (!order)
        return (double)NAN;
    for (size_t i = 0; i < n; i++) {
        positive += label[i];
        order[i] = i;
    }
    for (size_t i = n; i > 1; i--) { /* Fisher-Yates */
        size_t j = ggn_hash((uint32_t)i, l->seed + 77 + epoch) % i, keep = order[i - 1];
        order[i - 1] = order[j];
        order[j] = keep;
    }
    double weight[2] = {positive < (double)n ? 0.5 * (double)n / ((double)n - positive) : 0.0,
                        positive > 0.0 ? 0.5 * (double)n / positive : 0.0};
    for (size_t at = 0; at < n; at += BATCH) {
        int batch = n - at < BATCH ? (int)(n - at) : BATCH;
        for (int r = 0; r < batch; r++)
            load_sequence(l, r, sequences[order[at + (size_t)r]]);
        forward(l, batch, 1, logit);
        for (int r = 0; r < batch; r++) {
            int y = label[order[at + (size_t)r]];
            loss += weight[y] * ggn_bce((double)logit[r], y);
            d[r] = (float)weight[y] * (sigmoid(logit[r]) - (float)y) / (float)batch;
        }
        backward(l, batch, d);
        adam(l);
    }
    free(order);
    return n > 0 ? loss / (double)n : (double)NAN;
}

double ggn_lstm_logit(struct ggn_lstm *l, const double *const *sequence)
{
    float logit;
    for (int t = 0; t < l->steps; t++)
        load_step(l, 0, t, sequence[t]);
    forward(l, 1, 0, &logit);
    return (double)logit;
}

double ggn_lstm_gradient(struct ggn_lstm *l, const double *sequence, int label, float *grad)
{
    float logit, d;
    load_sequence(l, 0, sequence);
    forward(l, 1, 0, &logit);
    d = sigmoid(logit) - (float)label;
    backward(l, 1, &d);
    memcpy(grad, l->grad, l->n * sizeof *grad);
    return ggn_bce((double)logit, label);
}
