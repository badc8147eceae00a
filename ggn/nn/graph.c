#include "nn/graph.h"

#include <stdio.h>
#include <string.h>

static size_t round_up(size_t n, size_t to) { return (n + to - 1) / to * to; }

static int add_value(struct ggn_graph *g, int c, int h, int w, int flat)
{
    if (g->err.code)
        return 0;
    if (c < 1 || c > GGN_MAX_CHANNELS || h < 1 || w < 1 || h > GGN_MAX_SIDE || w > GGN_MAX_SIDE) {
        base_fail(&g->err, BASE_EINVAL, "network %s, stage %s: a tensor of %d×%d×%d is out of range", g->name, g->stage, c,
                  h, w);
        return 0;
    }
    if (g->n_values > GGN_MAX_LAYERS) {
        base_fail(&g->err, BASE_EINVAL, "network %s: more than %d layers", g->name, GGN_MAX_LAYERS);
        return 0;
    }
    struct ggn_value *v = &g->value[g->n_values];
    *v = (struct ggn_value){.c = c, .h = h, .w = w, .flat = flat, .offset = g->n_acts};
    if (flat) {
        v->row = 1;
        v->plane = 1;
        v->size = round_up((size_t)c, 16);
    } else {
        v->row = w + 1;
        v->origin = round_up((size_t)v->row + 1, 16);
        /* An odd number of cache lines, so that the same pixel of many planes does not fall into one cache set. */
        size_t lines = (v->origin + (size_t)v->row * ((size_t)h + 1) + GGN_PLANE_SLACK + 15) / 16;
        v->plane = (lines | 1) * 16;
        v->size = v->plane * (size_t)c;
    }
    g->n_acts += v->size;
    return g->n_values++;
}

static struct ggn_layer *add_layer(struct ggn_graph *g, enum ggn_op op, int in, int in2)
{
    if (!g->err.code && g->n_layers >= GGN_MAX_LAYERS)
        base_fail(&g->err, BASE_EINVAL, "network %s: more than %d layers", g->name, GGN_MAX_LAYERS);
    if (g->err.code)
        return &g->layer[GGN_MAX_LAYERS];
    struct ggn_layer *l = &g->layer[g->n_layers++];
    *l = (struct ggn_layer){.op = op, .in = in, .in2 = in2, .slope = 1, .stage = g->stage};
    g->value[in].uses++;
    if (in2 >= 0)
        g->value[in2].uses++;
    return l;
}

static size_t add_tensor(struct ggn_graph *g, const char *suffix, int is_bias, int is_bn, const int dim[4], int ndim)
{
    if (!g->err.code && g->n_tensors >= GGN_MAX_TENSORS)
        base_fail(&g->err, BASE_EINVAL, "network %s: more than %d tensors", g->name, GGN_MAX_TENSORS);
    if (g->err.code)
        return 0;
    struct ggn_tensor *t = &g->tensor[g->n_tensors++];
    *t = (struct ggn_tensor){
        .ndim = ndim, .offset = g->n_params, .count = 1, .layer = g->n_layers - 1, .is_bias = is_bias, .is_bn = is_bn};
    for (int i = 0; i < ndim; i++) {
        t->dim[i] = dim[i];
        t->count *= (size_t)dim[i];
    }
    snprintf(t->name, sizeof t->name, "%s.%d.%s", g->stage, g->n_stage_layers, suffix);
    g->n_params += t->count;
    return t->offset;
}

void ggn_graph_begin(struct ggn_graph *g, const char *name, int c, int h, int w)
{
    memset(g, 0, sizeof *g);
    snprintf(g->name, sizeof g->name, "%s", name);
    g->stage = "input";
    add_value(g, c, h, w, 0);
}

int ggn_graph_input(struct ggn_graph *g, int c) { return add_value(g, c, 1, 1, 1); }

void ggn_graph_stage(struct ggn_graph *g, const char *stage)
{
    g->stage = stage;
    g->n_stage_layers = 0;
}

int ggn_graph_conv(struct ggn_graph *g, int in, int in2, int c_out, int kernel, int transposed, double slope)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_CONV, in, in2);
    const struct ggn_value *a = &g->value[in];
    int c_in = a->c + (in2 >= 0 ? g->value[in2].c : 0);
    if (!g->err.code && in2 >= 0 && (g->value[in2].h != a->h || g->value[in2].w != a->w))
        base_fail(&g->err, BASE_EINVAL, "network %s, stage %s: joined tensors differ in size", g->name, g->stage);
    l->kernel = kernel;
    l->transposed = transposed;
    l->slope = slope;
    l->pack = g->n_pack;
    l->weight =
        add_tensor(g, "weight", 0, 0, (int[4]){transposed ? c_in : c_out, transposed ? c_out : c_in, kernel, kernel}, 4);
    l->bias = add_tensor(g, "bias", 1, 0, (int[4]){c_out}, 1);
    g->n_stage_layers++;
    g->n_pack += round_up((size_t)c_in * (size_t)c_out * (size_t)(kernel * kernel), 16);
    return l->out = add_value(g, c_out, a->h, a->w, 0);
}

int ggn_graph_conv_strided(struct ggn_graph *g, int in, int c_out, int stride, int pad)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_IM2COL, in, -1);
    const struct ggn_value *a = &g->value[in];
    l->stride = stride;
    l->pad = pad;
    l->kernel = 3;
    int columns = l->out = add_value(g, a->c * 9, (a->h + 2 * pad - 3) / stride + 1, (a->w + 2 * pad - 3) / stride + 1, 0);
    return ggn_graph_conv(g, columns, -1, c_out, 1, 0, 1);
}

int ggn_graph_bn(struct ggn_graph *g, int in)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_BN, in, -1);
    const struct ggn_value *a = &g->value[in];
    l->stats = g->n_stats;
    g->n_stats += (size_t)a->c;
    l->weight = add_tensor(g, "weight", 0, 1, (int[4]){a->c}, 1);
    l->bias = add_tensor(g, "bias", 1, 1, (int[4]){a->c}, 1);
    g->n_stage_layers++;
    return l->out = add_value(g, a->c, a->h, a->w, a->flat);
}

static int add_same_shape(struct ggn_graph *g, enum ggn_op op, int in, double slope, double drop)
{
    struct ggn_layer *l = add_layer(g, op, in, -1);
    l->slope = slope;
    l->drop = drop;
    return l->out = add_value(g, g->value[in].c, g->value[in].h, g->value[in].w, g->value[in].flat);
}

int ggn_graph_lrelu(struct ggn_graph *g, int in, double slope) { return add_same_shape(g, GGN_OP_LRELU, in, slope, 0); }

int ggn_graph_sigmoid(struct ggn_graph *g, int in) { return add_same_shape(g, GGN_OP_SIGMOID, in, 1, 0); }

int ggn_graph_dropout(struct ggn_graph *g, int in, double p)
{
    if (!g->err.code && !g->value[in].flat)
        base_fail(&g->err, BASE_EINVAL, "network %s, stage %s: dropout of planes, not of a vector", g->name, g->stage);
    return add_same_shape(g, GGN_OP_DROPOUT, in, 1, p);
}

int ggn_graph_maxpool(struct ggn_graph *g, int in, int kernel)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_MAXPOOL, in, -1);
    const struct ggn_value *a = &g->value[in];
    l->kernel = kernel;
    if (kernel == 2)
        return l->out = add_value(g, a->c, a->h / 2, a->w / 2, 0);
    return l->out = add_value(g, a->c, (a->h - 1) / 2 + 1, (a->w - 1) / 2 + 1, 0);
}

int ggn_graph_up(struct ggn_graph *g, int in, int pad_y, int pad_x)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_UP, in, -1);
    const struct ggn_value *a = &g->value[in];
    l->pad_y = pad_y;
    l->pad_x = pad_x;
    return l->out = add_value(g, a->c, 2 * a->h + pad_y, 2 * a->w + pad_x, 0);
}

int ggn_graph_flatten(struct ggn_graph *g, int in)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_FLATTEN, in, -1);
    const struct ggn_value *a = &g->value[in];
    return l->out = add_value(g, a->c * a->h * a->w, 1, 1, 1);
}

int ggn_graph_linear(struct ggn_graph *g, int in, int in2, int c_out)
{
    struct ggn_layer *l = add_layer(g, GGN_OP_LINEAR, in, in2);
    l->weight = add_tensor(g, "weight", 0, 0, (int[4]){c_out, ggn_layer_c_in(g, l)}, 2);
    l->bias = add_tensor(g, "bias", 1, 0, (int[4]){c_out}, 1);
    g->n_stage_layers++;
    return l->out = add_value(g, c_out, 1, 1, 1);
}

void ggn_graph_mark(struct ggn_graph *g, int value, const char *stage) { g->value[value].stage = stage; }

int ggn_graph_end(struct ggn_graph *g, struct base_err *err)
{
    unsigned char written[GGN_MAX_LAYERS + 1] = {0};
    if (g->err.code)
        return base_fail(err, g->err.code, "%s", g->err.text);
    for (int i = g->n_layers - 1; i >= 0; i--) {
        struct ggn_layer *l = &g->layer[i];
        l->add_in = written[l->in];
        written[l->in] = 1;
        if (l->in2 >= 0) {
            l->add_in2 = written[l->in2];
            written[l->in2] = 1;
        }
    }
    g->n_learned = g->n_params + 2 * g->n_stats;
    return 0;
}

static int same_geometry(const struct ggn_value *a, const struct ggn_value *b)
{
    return a->h == b->h && a->w == b->w && a->flat == b->flat;
}

/* First layer that writes and last that reads each value; input and output live for ever. */
static void find_lifetimes(const struct ggn_graph *g, int born[], int dies[])
{
    for (int i = 0; i < g->n_values; i++) {
        born[i] = -1;
        dies[i] = g->n_layers;
    }
    for (int i = 0; i < g->n_layers; i++) {
        const struct ggn_layer *l = &g->layer[i];
        born[l->out] = l->op == GGN_OP_BN && i > 0 ? i - 1 : i; /* a convolution may write the batch norm's output itself */
        if (l->in > 0)
            dies[l->in] = i;
        if (l->in2 > 0)
            dies[l->in2] = i;
    }
    dies[g->n_values - 1] = g->n_layers;
}

size_t ggn_graph_place(const struct ggn_graph *g, size_t offset[GGN_MAX_LAYERS + 1])
{
    int born[GGN_MAX_LAYERS + 1], dies[GGN_MAX_LAYERS + 1];
    size_t total = 0;
    find_lifetimes(g, born, dies);
    for (int first = 0; first < g->n_values; first++) { /* one round per geometry, led by its first value */
        size_t end = total;
        int seen = 0;
        for (int j = 0; j < first; j++)
            seen |= same_geometry(&g->value[j], &g->value[first]);
        for (int i = first; i < g->n_values && !seen; i++) {
            const struct ggn_value *v = &g->value[i];
            if (!same_geometry(v, &g->value[first]))
                continue;
            offset[i] = total;
            for (int j = first; j < i; j++)
                if (same_geometry(&g->value[j], v) && dies[j] >= born[i] && offset[j] < offset[i] + v->size &&
                    offset[i] < offset[j] + g->value[j].size) {
                    offset[i] = offset[j] + g->value[j].size;
                    j = first - 1; /* moved: look at all of them again */
                }
            end = offset[i] + v->size > end ? offset[i] + v->size : end;
        }
        total = end;
    }
    return total;
}

const char *ggn_op_name(enum ggn_op op)
{
#define NAME(op, name, text) text,
    static const char *const names[] = {GGN_OPS(NAME)};
    return names[op];
}

int ggn_layer_c_in(const struct ggn_graph *g, const struct ggn_layer *l)
{
    return g->value[l->in].c + (l->in2 >= 0 ? g->value[l->in2].c : 0);
}

double ggn_layer_mac(const struct ggn_graph *g, int layer)
{
    const struct ggn_layer *l = &g->layer[layer];
    const struct ggn_value *out = &g->value[l->out];
    double c_in = ggn_layer_c_in(g, l);
    if (l->op == GGN_OP_LINEAR)
        return c_in * out->c;
    if (l->op == GGN_OP_CONV)
        return c_in * out->c * l->kernel * l->kernel * out->h * out->w;
    return 0;
}

double ggn_graph_mac(const struct ggn_graph *g)
{
    double sum = 0;
    for (int i = 0; i < g->n_layers; i++)
        sum += ggn_layer_mac(g, i);
    return sum;
}
