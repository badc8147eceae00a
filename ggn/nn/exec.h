/*
 * Runs a network forward and backward for a batch of images.
 *
 * An executor owns activations (and gradients) for up to `capacity` images and borrows graph and threads. Numbers do not
 * depend on the number of threads, nor, with running statistics (GGN_EVAL), on which images share a batch. One call at a
 * time per executor; several executors may read the same weights at once. Nothing is allocated after create.
 */
#ifndef GGN_NN_EXEC_H
#define GGN_NN_EXEC_H

#include <string.h>

#include "base/threads.h"
#include "nn/weights.h"

#define GGN_BN_MOMENTUM 0.1

enum ggn_mode {
    GGN_EVAL, /* running statistics, no dropout */
    GGN_TRAIN /* batch statistics (running ones are updated), dropout */
};

enum {
    GGN_EXEC_GRADS = 1,      /* room for the backward pass */
    GGN_EXEC_INPUT_GRAD = 2, /* backward also computes the gradient of the input */
    GGN_EXEC_NO_DROPOUT = 4,
    GGN_EXEC_NO_FUSE = 8 /* keep every intermediate value in GGN_EVAL too */
};

struct ggn_exec {
    const struct ggn_graph *graph;
    const struct ggn_kernels *kernels;
    struct base_threads *threads;              /* NULL: the calling thread alone */
    int capacity, batch, flags;                /* images: most; of the last forward pass */
    enum ggn_mode mode;                        /* of the last forward pass */
    uint32_t dropout_seed;                     /* masks are a function of it; change it between passes */
    size_t offset[GGN_MAX_LAYERS + 1], n_acts; /* where each value starts in one image's activations; their total */
    real *acts, *grads;                        /* [capacity][n_acts]; behind this struct, as all arrays are */
    real *bn_mean, *bn_inv;                    /* [n_stats] of the last training-mode pass */
    real *scratch;                             /* [workers][scratch_size] */
    size_t scratch_size;
    double *sums;      /* of one batch norm: [2][channels] of the batch, then [capacity][channels][2] of its images */
    real *params_grad; /* of the backward pass under way */
    real *leaves;      /* [capacity][leaf_size] the weights' gradient of each image, one convolution at a time */
    size_t leaf_size;
    double *layer_s; /* [n_layers] or NULL; when set, forward adds the seconds of each layer */
};

/* Bytes that an executor allocates. */
size_t ggn_exec_bytes(const struct ggn_graph *graph, int capacity, int flags, int workers);
/* `kernels` must be those of the weights (NULL = the best). NULL on failure. */
struct ggn_exec *ggn_exec_create(const struct ggn_graph *graph, const struct ggn_kernels *kernels, int capacity, int flags,
                                 struct base_threads *threads, struct base_err *err);
static inline void ggn_exec_destroy(struct ggn_exec *exec) { free(exec); }

/* Element (0,0) of plane `c` of value `value` of image `n` among all of a kind; rows are graph->value[value].row apart. */
static inline real *ggn_exec_at(const struct ggn_exec *exec, real *all, int value, long n, int c)
{
    const struct ggn_value *v = &exec->graph->value[value];
    return all + (size_t)n * exec->n_acts + exec->offset[value] + v->origin + (size_t)c * v->plane;
}

/* Value 0 is the input, which the caller writes (h × w elements of each plane, nothing else); n_values − 1 is the output. */
static inline real *ggn_exec_plane(const struct ggn_exec *exec, int value, long n, int c)
{
    return ggn_exec_at(exec, exec->acts, value, n, c);
}

static inline real *ggn_exec_output(const struct ggn_exec *exec, long n, int c)
{
    return ggn_exec_plane(exec, exec->graph->n_values - 1, n, c);
}

/* The caller writes the gradient of the output before backward and may read that of the input after. */
static inline real *ggn_exec_grad(const struct ggn_exec *exec, int value, long n, int c)
{
    return ggn_exec_at(exec, exec->grads, value, n, c);
}

/* Copies one plane of the size of `v` from rows that lie `row` apart to rows as `v` has them. */
static inline void ggn_plane_copy(const struct ggn_value *v, real *to, const real *from, int row)
{
    for (int y = 0; y < v->h; y++)
        memcpy(to + (long)y * v->row, from + (long)y * row, (size_t)v->w * sizeof *to);
}

/* The same into plane `c` of the input of image `n`. */
static inline void ggn_exec_load(const struct ggn_exec *exec, int n, int c, const real *from, int row)
{
    ggn_plane_copy(&exec->graph->value[0], ggn_exec_plane(exec, 0, n, c), from, row);
}

/* Images 0..batch−1. GGN_TRAIN updates the running statistics in `weights` (not the packed ones: pack before evaluating). */
void ggn_exec_forward(struct ggn_exec *exec, struct ggn_weights *weights, int batch, enum ggn_mode mode);
/* Adds to params_grad [n_params]. Activations stay, so that it may be called again for another gradient of the output. */
void ggn_exec_backward(struct ggn_exec *exec, const struct ggn_weights *weights, real *params_grad);

#endif
