#include "nn/weights.h"

#include <math.h>
#include <stdlib.h>

#include "base/pi.h"
#include "nn/hash.h"
#include "nn/real.h"
#include "nn/winograd.h"

enum { ALIGN = 64 };

static size_t padded(size_t n)
{
    const size_t unit = ALIGN / sizeof(real);
    return (n + unit - 1) / unit * unit + unit;
}

struct ggn_weights *ggn_weights_create(const struct ggn_graph *graph, const struct ggn_kernels *kernels, int flags,
                                       struct base_err *err)
{
    size_t learned = padded(graph->n_learned), stats = padded(graph->n_stats), pack = padded(graph->n_pack);
    const struct ggn_kernels *k = kernels ? kernels : ggn_kernels_best();
    size_t wino = k->wino ? 4 * pack : 0;
    size_t bytes = (learned + 2 * stats + (flags & GGN_WEIGHTS_BACKWARD ? 2 : 1) * (pack + wino)) * sizeof(real);
    struct ggn_weights *w = calloc(1, sizeof *w + ALIGN + bytes);
    if (!w) {
        base_fail_nomem(err, "network weights");
        return NULL;
    }
    char *memory = (char *)(w + 1);
    w->graph = graph;
    w->kernels = k;
    w->params = (real *)(void *)(memory + (ALIGN - (size_t)memory % ALIGN) % ALIGN);
    w->mean = w->params + graph->n_params;
    w->var = w->mean + graph->n_stats;
    w->scale = w->params + learned;
    w->shift = w->scale + stats;
    w->pack = w->shift + stats;
    w->wino = wino ? w->pack + pack : NULL;
    w->pack_back = flags & GGN_WEIGHTS_BACKWARD ? w->pack + pack + wino : NULL;
    w->wino_back = w->pack_back && wino ? w->pack_back + pack : NULL;
    for (size_t i = 0; i < graph->n_stats; i++)
        w->var[i] = 1;
    return w;
}

/* Box–Muller from two hashes. */
static double normal(uint32_t k, uint32_t seed)
{
    double u = 1 - ggn_hash_unit(2 * k, seed), v = ggn_hash_unit(2 * k + 1, seed);
    return sqrt(-2 * log(u)) * cos(2 * BASE_PI * v);
}

static double initial(const struct ggn_tensor *t, enum ggn_init init, double fan_in, uint32_t k, uint32_t seed)
{
    double u = 2 * ggn_hash_unit(k, seed) - 1;
    if (init == GGN_INIT_HASH)
        return t->is_bn && !t->is_bias ? 1 + 0.1 * u : t->is_bias ? 0.1 * u : u * sqrt(6 / fan_in);
    if (t->is_bn)
        return t->is_bias ? 0 : init == GGN_INIT_GAN ? 1 + 0.02 * normal(k, seed) : 1;
    if (init == GGN_INIT_GAN && !t->is_bias && t->ndim == 4)
        return 0.02 * normal(k, seed);
    if (init == GGN_INIT_HE)
        return t->is_bias ? 0 : normal(k, seed) * sqrt(2 / (1.04 * fan_in));
    return u / sqrt(fan_in);
}

void ggn_weights_init(struct ggn_weights *w, enum ggn_init init, uint32_t seed)
{
    const struct ggn_graph *g = w->graph;
    for (int i = 0; i < g->n_tensors; i++) {
        const struct ggn_tensor *t = &g->tensor[i], *weight = t->is_bias && !t->is_bn ? t - 1 : t;
        int transposed = g->layer[t->layer].transposed;
        double fan_in = weight->ndim >= 2 ? (double)(weight->count / (size_t)weight->dim[transposed ? 1 : 0]) : 1;
        for (size_t k = 0; k < t->count; k++)
            w->params[t->offset + k] = (real)initial(t, init, fan_in, (uint32_t)k, seed + (uint32_t)i);
    }
    for (size_t i = 0; i < g->n_stats; i++) {
        w->mean[i] = 0;
        w->var[i] = 1;
    }
}

/* Tiles of kernels->tile_oc output channels, the last one of what is left; inside a tile [n_in][taps][tile]. `back` packs
 * the convolution of the backward pass: inputs and outputs swapped, taps mirrored. */
static void pack_conv(real *out, const struct ggn_weights *w, const struct ggn_layer *l, int back)
{
    const struct ggn_graph *g = w->graph;
    const int c_in = ggn_layer_c_in(g, l), c_out = g->value[l->out].c;
    const int n_in = back ? c_out : c_in, n_out = back ? c_in : c_out, taps = l->kernel * l->kernel;
    /* the stored tensor is [out][in] or [in][out]; its first index is the packed output or the packed input */
    const int o_first = l->transposed == back, flip = l->transposed != back;
    const size_t o_step = (size_t)taps * (o_first ? (size_t)n_in : 1), i_step = (size_t)taps * (o_first ? 1 : (size_t)n_out);
    for (int oc = 0, tile; oc < n_out; oc += tile) {
        tile = n_out - oc < w->kernels->tile_oc ? n_out - oc : w->kernels->tile_oc;
        for (int i = 0; i < n_in; i++)
            for (int t = 0; t < taps; t++) {
                const real *from =
                    w->params + l->weight + (size_t)oc * o_step + (size_t)i * i_step + (size_t)(flip ? taps - 1 - t : t);
                for (int o = 0; o < tile; o++, from += o_step)
                    *out++ = *from;
            }
    }
}

static void pack_layer(void *data, long i, int worker)
{
    struct ggn_weights *w = data;
    const struct ggn_graph *g = w->graph;
    const struct ggn_layer *l = &g->layer[i];
    const struct ggn_kernels *k = w->kernels;
    const struct ggn_value *v = &g->value[l->out];
    const int c_in = ggn_layer_c_in(g, l);
    if (l->op == GGN_OP_CONV) {
        pack_conv(w->pack + l->pack, w, l, 0);
        if (w->pack_back)
            pack_conv(w->pack_back + l->pack, w, l, 1);
        if (l->kernel == 3 && w->wino && ggn_wino_suits(c_in, v->c, v->h, v->w, k->lanes)) {
            k->wino_pack(w->wino + 4 * l->pack, w->pack + l->pack, c_in, v->c, k->tile_oc);
            if (w->wino_back)
                k->wino_pack(w->wino_back + 4 * l->pack, w->pack_back + l->pack, v->c, c_in, k->tile_oc);
        }
    }
    for (int c = 0; l->op == GGN_OP_BN && c < v->c; c++) {
        size_t s = l->stats + (size_t)c;
        double scale = (double)w->params[l->weight + (size_t)c] / sqrt((double)w->var[s] + GGN_BN_EPS);
        w->scale[s] = (real)scale;
        w->shift[s] = (real)((double)w->params[l->bias + (size_t)c] - (double)w->mean[s] * scale);
    }
    (void)worker;
}

void ggn_weights_pack(struct ggn_weights *w, struct base_threads *threads)
{
    base_threads_for(threads, w->graph->n_layers, pack_layer, w);
}

void ggn_weights_copy(struct ggn_weights *w, const float *learned)
{
    for (size_t i = 0; i < w->graph->n_learned; i++)
        w->params[i] = (real)learned[i];
    ggn_weights_pack(w, NULL);
}
