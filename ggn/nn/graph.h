/*
 * A network as data: values (tensors of one image) and the layers that compute them, in execution order.
 *
 * A graph holds shapes, memory layout and parameter layout and no numbers; weights (nn/weights.h) and executors (nn/exec.h)
 * of either precision share it. Immutable once built, then safe to read from any thread. One flat struct, no pointers owned.
 *
 * Layout of a value: C planes. Each plane stores H rows of W + 1 elements, the last always 0, with at least one row of zeros
 * before and after: the zero padding of a 3×3 convolution is thus part of the memory and a convolution is a sum over
 * constant offsets of one flat array. `flat` values (vectors) are C consecutive elements.
 */
#ifndef GGN_NN_GRAPH_H
#define GGN_NN_GRAPH_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum {
    GGN_MAX_LAYERS = 96,
    GGN_MAX_TENSORS = 128,
    GGN_MAX_CHANNELS = 4096,
    GGN_MAX_SIDE = 2048,
    GGN_PLANE_SLACK = 64 /* elements after a plane that kernels may touch: one register tile */
};

struct ggn_value {
    int c, h, w;
    int flat;
    int row;           /* elements from one row to the next */
    size_t origin;     /* elements before (0,0) of plane 0 */
    size_t plane;      /* elements from one plane to the next */
    size_t size;       /* elements of all planes */
    size_t offset;     /* where the value starts among the activations of one image */
    int uses;          /* layers that read it */
    const char *stage; /* name under which the golden values (tests/support/ggn_golden.h) have its rms, or NULL; static */
};

/* The layers: OP(enumerator, name of its passes in nn/layers.h, name for people).
 * CONV: 3×3 stride 1 pad 1 or 1×1, bias, then LeakyReLU when slope != 1; reads `in` and `in2` as one. IM2COL: C planes → C·9
 * planes of the windows of a strided 3×3 convolution. BN: batch normalisation per channel. MAXPOOL: kernel 2 stride 2, or
 * kernel 3 stride 2 pad 1. UP: bilinear ×2, half-pixel centres, then pad_y zero rows on top and pad_x zero columns on the
 * left. FLATTEN: planes → vector in (C, H, W) order. LINEAR: of a vector, and of `in2` behind it. */
#define GGN_OPS(OP) \
    OP(CONV, conv, "conv") \
    OP(IM2COL, im2col, "im2col") \
    OP(BN, bn, "batch norm") \
    OP(LRELU, lrelu, "leaky relu") \
    OP(SIGMOID, sigmoid, "sigmoid") \
    OP(MAXPOOL, maxpool, "max pool") \
    OP(UP, up, "upsample") \
    OP(FLATTEN, flatten, "flatten") \
    OP(LINEAR, linear, "linear") \
    OP(DROPOUT, dropout, "dropout")

#define GGN_OP_ENUMERATE(op, name, text) GGN_OP_##op,
enum ggn_op { GGN_OPS(GGN_OP_ENUMERATE) };

struct ggn_layer {
    enum ggn_op op;
    int in, in2, out;    /* values; in2 = -1 without */
    int kernel;          /* CONV 3 or 1, MAXPOOL 2 or 3 */
    int stride, pad;     /* IM2COL */
    int transposed;      /* CONV: weights are [in, out, k, k] and flipped */
    int pad_y, pad_x;    /* UP */
    double slope;        /* CONV, LRELU */
    double drop;         /* DROPOUT: probability of a zero */
    size_t weight, bias; /* offsets into the parameters */
    size_t pack;         /* CONV: offset into the packed weights */
    size_t stats;        /* BN: offset into running means and variances */
    int add_in, add_in2; /* backward adds to the gradient of in / in2, because a later layer wrote it already */
    const char *stage;   /* name of the stage the layer belongs to; static */
};

/* One named parameter tensor; the order is the layer order, weight before bias. */
struct ggn_tensor {
    char name[32]; /* "enc1.0.weight" */
    int ndim;
    int dim[4];
    size_t offset, count;
    int layer;
    int is_bias, is_bn;
};

struct ggn_graph {
    char name[16];
    struct ggn_value value[GGN_MAX_LAYERS + 1]; /* value 0 is the input */
    struct ggn_layer layer[GGN_MAX_LAYERS + 1]; /* the last one takes what is added after a failure */
    struct ggn_tensor tensor[GGN_MAX_TENSORS];
    int n_values, n_layers, n_tensors;
    size_t n_params, n_stats, n_pack;
    size_t n_learned;   /* n_params + 2·n_stats: parameters and running statistics */
    size_t n_acts;      /* elements of all values of one image */
    int n_stage_layers; /* parameter layers since the stage began; for names */
    const char *stage;
    struct base_err err; /* first failure while building */
};

/* Starts a graph whose input is c × h × w. */
void ggn_graph_begin(struct ggn_graph *g, const char *name, int c, int h, int w);
/* A second input, a vector of c numbers; before any layer. Returns its value. */
int ggn_graph_input(struct ggn_graph *g, int c);
/* Layers added from here on belong to `stage` (static text). */
void ggn_graph_stage(struct ggn_graph *g, const char *stage);
/* Each adds one layer and returns the value it computes. After a failure (bad shape, too many layers) every call does
 * nothing and ggn_graph_end reports it. `in2` may be -1. */
int ggn_graph_conv(struct ggn_graph *g, int in, int in2, int c_out, int kernel, int transposed, double slope);
int ggn_graph_conv_strided(struct ggn_graph *g, int in, int c_out, int stride, int pad); /* 3×3: IM2COL, then CONV 1×1 */
int ggn_graph_bn(struct ggn_graph *g, int in);
int ggn_graph_lrelu(struct ggn_graph *g, int in, double slope);
int ggn_graph_sigmoid(struct ggn_graph *g, int in);
int ggn_graph_maxpool(struct ggn_graph *g, int in, int kernel);
int ggn_graph_up(struct ggn_graph *g, int in, int pad_y, int pad_x);
int ggn_graph_flatten(struct ggn_graph *g, int in);
int ggn_graph_linear(struct ggn_graph *g, int in, int in2, int c_out);
int ggn_graph_dropout(struct ggn_graph *g, int in, double p); /* of a vector */
/* Names the value for the golden values. */
void ggn_graph_mark(struct ggn_graph *g, int value, const char *stage);
/* Plans the backward pass; the last value is the output. BASE_EINVAL with the first failure. */
int ggn_graph_end(struct ggn_graph *g, struct base_err *err);

/* Memory for inference: offset[value] such that values alive at the same time do not overlap, and memory is only handed on
 * between values of equal height and width, whose zero padding lies at the same places. Returns the elements per image. */
size_t ggn_graph_place(const struct ggn_graph *g, size_t offset[GGN_MAX_LAYERS + 1]);

/* The last value. */
static inline const struct ggn_value *ggn_graph_output(const struct ggn_graph *g) { return &g->value[g->n_values - 1]; }
/* "conv" … */
const char *ggn_op_name(enum ggn_op op);
/* Channels of `in` and `in2` together. */
int ggn_layer_c_in(const struct ggn_graph *g, const struct ggn_layer *layer);
/* Multiply-accumulates of one layer for one image, and of all. */
double ggn_layer_mac(const struct ggn_graph *g, int layer);
double ggn_graph_mac(const struct ggn_graph *g);

#endif
