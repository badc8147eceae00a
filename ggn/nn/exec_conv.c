/* Convolutions, direct or by Winograd, and their gradients. */
#include <string.h>

#include "nn/layers.h"
#include "nn/real.h"
#include "nn/winograd.h"

enum {
    GRAD_CHUNK = 512, /* pixels whose gradients stay in the first-level cache */
    SUM_CHUNK = 4096  /* weights whose gradients one task adds up */
};

/* Pointers to all planes of a layer's input(s); returns their number. */
static int input_planes(real **out, const struct ggn_task *t, real *base, long n)
{
    const struct ggn_graph *g = t->e->graph;
    const struct ggn_layer *l = t->l;
    int k = 0;
    for (int c = 0; c < g->value[l->in].c; c++)
        out[k++] = ggn_exec_at(t->e, base, l->in, n, c);
    for (int c = 0; l->in2 >= 0 && c < g->value[l->in2].c; c++)
        out[k++] = ggn_exec_at(t->e, base, l->in2, n, c);
    return k;
}

/* Cuts the work into pieces that depend on the shape only. `wino`: all Winograd weights of this direction or NULL. */
static long cut_conv(struct ggn_task *t, int c_in, int c_out, const real *wino)
{
    const struct ggn_value *v = ggn_task_out(t);
    if (wino && t->l->kernel == 3 && ggn_wino_suits(c_in, c_out, v->h, v->w, t->e->kernels->lanes)) {
        t->wino = wino + 4 * t->l->pack;
        ggn_wino_cut(ggn_wino_tiles(v->h, v->w), c_out, &t->px_blocks, &t->oc_group);
    } else {
        t->wino = NULL;
        t->px_block = 16L * t->e->kernels->tile_px;
        t->px_blocks = (int)(((long)v->h * v->row + t->px_block - 1) / t->px_block);
        t->oc_group = t->px_blocks >= 8 ? c_out : 32;
    }
    t->oc_groups = (c_out + t->oc_group - 1) / t->oc_group;
    return (long)t->e->batch * t->px_blocks * t->oc_groups;
}

/* A piece of Y, or in the backward pass of dX: the same convolution with inputs and outputs swapped and taps mirrored. */
static void conv_piece(const struct ggn_task *t, long i)
{
    const struct ggn_layer *l = t->l;
    const struct ggn_value *v = ggn_task_out(t);
    const long n = i / ((long)t->px_blocks * t->oc_groups), part = i / t->oc_groups % t->px_blocks;
    real *all = t->back ? t->e->grads : t->e->acts, *x[GGN_MAX_CHANNELS], *y[GGN_MAX_CHANNELS];
    unsigned char add[GGN_MAX_CHANNELS];
    const int c_in = input_planes(x, t, all, n);
    struct ggn_conv conv = {.x = (const real *const *)x,
                            .y = y,
                            .n_in = c_in,
                            .n_out = v->c,
                            .taps = l->kernel * l->kernel,
                            .h = v->h,
                            .w_px = v->w,
                            .row = v->row};
    for (int c = 0; c < v->c; c++)
        y[c] = ggn_exec_at(t->e, all, t->bn ? t->bn->out : l->out, n, c);
    if (t->back) {
        for (int c = 0; c < c_in; c++)
            add[c] = (unsigned char)(c < ggn_task_in(t)->c ? l->add_in : l->add_in2);
        conv.x = (const real *const *)y;
        conv.y = x;
        conv.n_in = v->c;
        conv.n_out = c_in;
        conv.w = t->w->pack_back + l->pack;
        conv.add = add;
        conv.slope = 1;
    } else {
        conv.w = t->w->pack + l->pack;
        conv.bias = t->w->params + l->bias;
        conv.scale = t->bn ? t->w->scale + t->bn->stats : NULL;
        conv.shift = t->bn ? t->w->shift + t->bn->stats : NULL;
        conv.slope = (real)l->slope;
    }
    const int oc0 = (int)(i % t->oc_groups) * t->oc_group;
    const int oc1 = oc0 + t->oc_group < conv.n_out ? oc0 + t->oc_group : conv.n_out;
    /* Winograd's algorithm has its own grid of tiles: a piece's share of them, since a block of pixels may cut one */
    const long tiles = ggn_wino_tiles(v->h, v->w), p0 = part * t->px_block;
    if (t->wino)
        t->e->kernels->wino(&conv, t->wino, (int)(tiles * part / t->px_blocks), (int)(tiles * (part + 1) / t->px_blocks),
                            oc0, oc1, t->scratch);
    else
        t->e->kernels->conv(&conv, p0, p0 + t->px_block, oc0, oc1);
}

static void conv_forward(struct ggn_task *t)
{
    ggn_task_run(t, cut_conv(t, ggn_task_c_in(t), ggn_task_out(t)->c, t->w->wino), conv_piece);
}

/* Through the activation, in place, and db[c] += Σ dY[c]. */
static void conv_act_back(const struct ggn_task *t, long c)
{
    const struct ggn_value *v = ggn_task_out(t);
    double sum = 0;
    for (int n = 0; n < t->e->batch; n++) {
        real *dy = ggn_exec_grad(t->e, t->l->out, n, (int)c);
        sum += t->l->slope == 1 ? t->e->kernels->sum(dy, v->h, v->w, v->row)
                                : t->e->kernels->act_grad(dy, ggn_exec_plane(t->e, t->l->out, n, (int)c), (real)t->l->slope,
                                                          v->h, v->w, v->row);
    }
    t->e->params_grad[t->l->bias + (size_t)c] += (real)sum;
}

/* A part of dW: `ot` output channels from `oc` on, `nic` input channels from `ic0` on. */
struct weight_part {
    int oc, ot, ic0, nic;
};

/* Where the taps of an output and an input channel lie among the weights, and in which order. */
static size_t weight_at(const struct ggn_task *t, int o, int i)
{
    const size_t n_in = (size_t)ggn_task_c_in(t), c_out = (size_t)ggn_task_out(t)->c;
    const size_t pair = t->l->transposed ? (size_t)i * c_out + (size_t)o : (size_t)o * n_in + (size_t)i;
    return pair * (size_t)(t->l->kernel * t->l->kernel);
}

/* Tasks of one image and up to so many channels. */
static long cut_weights(struct ggn_task *t)
{
    const struct ggn_kernels *k = t->e->kernels;
    const struct ggn_value *v = ggn_task_out(t);
    const int n_in = ggn_task_c_in(t);
    t->weights_by_wino = k->wino_grad && t->l->kernel == 3 && ggn_wino_grad_suits(n_in, v->c, v->h, v->w, k->lanes);
    t->oc_group = t->weights_by_wino ? GGN_WINO_GRAD : k->tile_oc;
    t->ic_group = t->weights_by_wino ? GGN_WINO_GRAD : GGN_GRAD_IC;
    t->oc_groups = (v->c + t->oc_group - 1) / t->oc_group;
    t->ic_groups = (n_in + t->ic_group - 1) / t->ic_group;
    return (long)t->e->batch * t->oc_groups * t->ic_groups;
}

static void weights_by_definition(const struct ggn_task *t, const struct weight_part *p, real *const *x,
                                  const real *const *dy, real *leaf)
{
    const struct ggn_value *v = ggn_task_out(t);
    const struct ggn_kernels *k = t->e->kernels;
    const int taps = t->l->kernel * t->l->kernel, values = p->ot * p->nic * taps;
    const long px = (long)v->h * v->row;
    real sums[GGN_TILE_MAX * GGN_GRAD_IC * 9]; /* [nic][taps][ot] */
    memset(t->scratch, 0, (size_t)(values * k->lanes) * sizeof *t->scratch);
    for (long at = 0; at < px; at += GRAD_CHUNK)
        k->conv_grad(t->scratch, (const real *const *)x, p->nic, dy, p->ot, taps, v->row, at,
                     at + GRAD_CHUNK < px ? at + GRAD_CHUNK : px);
    k->lane_sums(sums, t->scratch, values);
    for (int ic = 0; ic < p->nic; ic++)
        for (int o = 0; o < p->ot; o++) {
            real *to = leaf + weight_at(t, p->oc + o, p->ic0 + ic);
            for (int tap = 0; tap < taps; tap++)
                to[t->l->transposed ? taps - 1 - tap : tap] = sums[(ic * taps + tap) * p->ot + o];
        }
}

static void weights_by_wino(const struct ggn_task *t, const struct weight_part *p, real *const *x, const real *const *dy,
                            real *leaf)
{
    const struct ggn_value *v = ggn_task_out(t);
    const struct ggn_conv_grad grad = {
        .x = (const real *const *)x,
        .dy = dy,
        .n_in = p->nic,
        .n_out = p->ot,
        .h = v->h,
        .w_px = v->w,
        .row = v->row,
        .dw = leaf + weight_at(t, p->oc, p->ic0),
        .o_step = (long)weight_at(t, 1, 0),
        .i_step = (long)weight_at(t, 0, 1),
        .mirrored = t->l->transposed,
    };
    t->e->kernels->wino_grad(&grad, t->scratch);
}

/* dW of one image and one group of output and of input channels, into the image's leaf. */
static void conv_weight_back(const struct ggn_task *t, long i)
{
    const int n_in = ggn_task_c_in(t), c_out = ggn_task_out(t)->c;
    const long n = i / (t->oc_groups * t->ic_groups);
    struct weight_part p = {.oc = (int)(i / t->ic_groups % t->oc_groups) * t->oc_group,
                            .ic0 = (int)(i % t->ic_groups) * t->ic_group};
    real *x[GGN_MAX_CHANNELS];
    const real *dy[GGN_WINO_GRAD];
    p.ot = c_out - p.oc < t->oc_group ? c_out - p.oc : t->oc_group;
    p.nic = n_in - p.ic0 < t->ic_group ? n_in - p.ic0 : t->ic_group;
    input_planes(x, t, t->e->acts, n);
    for (int o = 0; o < p.ot; o++)
        dy[o] = ggn_exec_grad(t->e, t->l->out, n, p.oc + o);
    (t->weights_by_wino ? weights_by_wino : weights_by_definition)(t, &p, x + p.ic0, dy, ggn_leaf(t, n));
}

/* Some elements of the leaves into the gradient. */
static void conv_weight_sum(const struct ggn_task *t, long i)
{
    const size_t from = (size_t)i * SUM_CHUNK, count = ggn_conv_weights(t->e->graph, t->l);
    const long n = (long)(count - from < SUM_CHUNK ? count - from : SUM_CHUNK);
    for (int image = 0; image < t->e->batch; image++)
        t->e->kernels->axpy(t->e->params_grad + t->l->weight + from, 1, ggn_leaf(t, image) + from, n);
}

static int needs_input_grad(const struct ggn_task *t) { return t->l->in != 0 || (t->e->flags & GGN_EXEC_INPUT_GRAD); }

static void conv_backward(struct ggn_task *t)
{
    const struct ggn_graph *g = t->e->graph;
    const int c_out = ggn_task_out(t)->c;
    const int c_in = ggn_task_c_in(t);
    ggn_task_run(t, c_out, conv_act_back);
    ggn_task_run(t, cut_weights(t), conv_weight_back);
    ggn_task_run(t, (long)((ggn_conv_weights(g, t->l) + SUM_CHUNK - 1) / SUM_CHUNK), conv_weight_sum);
    if (needs_input_grad(t))
        ggn_task_run(t, cut_conv(t, c_out, c_in, t->w->wino_back), conv_piece);
}

const struct ggn_layer_passes GGN_LAYER(conv) = {conv_forward, conv_backward};

/* Columns of a strided 3×3 convolution: plane 9c + tap holds channel c at that tap, 0 outside. */
static void im2col_piece(const struct ggn_task *t, long i)
{
    const struct ggn_value *in = ggn_task_in(t), *out = ggn_task_out(t);
    long n = i / out->c;
    int c = (int)(i % out->c), dy = c % 9 / 3 - t->l->pad, dx = c % 3 - t->l->pad;
    const real *x = ggn_exec_plane(t->e, t->l->in, n, c / 9);
    real *y = ggn_exec_plane(t->e, t->l->out, n, c);
    int s0 = 0, s1 = out->w; /* columns [s0, s1) lie inside */
    while (s0 < s1 && s0 * t->l->stride + dx < 0)
        s0++;
    while (s1 > s0 && (s1 - 1) * t->l->stride + dx >= in->w)
        s1--;
    for (int r = 0; r < out->h; r++, y += out->row) {
        const int yy = r * t->l->stride + dy;
        memset(y, 0, (size_t)out->w * sizeof *y);
        if (yy < 0 || yy >= in->h)
            continue;
        const real *from = x + (long)yy * in->row + (long)s0 * t->l->stride + dx;
        for (int s = s0; s < s1; s++, from += t->l->stride)
            y[s] = *from;
    }
}

static void im2col_forward(struct ggn_task *t) { ggn_task_run(t, (long)t->e->batch * ggn_task_out(t)->c, im2col_piece); }

static void im2col_back_piece(const struct ggn_task *t, long i)
{
    const struct ggn_value *in = ggn_task_in(t), *out = ggn_task_out(t);
    long n = i / in->c;
    int c = (int)(i % in->c);
    real *dx = ggn_exec_grad(t->e, t->l->in, n, c);
    for (int r = 0; r < in->h && !t->l->add_in; r++)
        memset(dx + (long)r * in->row, 0, (size_t)in->w * sizeof *dx);
    for (int tap = 0; tap < 9; tap++) {
        const real *d = ggn_exec_grad(t->e, t->l->out, n, 9 * c + tap);
        for (int r = 0; r < out->h; r++)
            for (int s = 0; s < out->w; s++) {
                int yy = r * t->l->stride + tap / 3 - t->l->pad, xx = s * t->l->stride + tap % 3 - t->l->pad;
                if (yy >= 0 && yy < in->h && xx >= 0 && xx < in->w)
                    dx[(long)yy * in->row + xx] += d[r * out->row + s];
            }
    }
}

static void im2col_backward(struct ggn_task *t)
{
    if (needs_input_grad(t))
        ggn_task_run(t, (long)t->e->batch * ggn_task_in(t)->c, im2col_back_piece);
}

const struct ggn_layer_passes GGN_LAYER(im2col) = {im2col_forward, im2col_backward};
