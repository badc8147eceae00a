/*
 * Runs a network forward and backward for a batch of images.
 *
 * An executor owns activations (and gradients) for up to `capacity` images and borrows graph and threads. Numbers do not
 * depend on the number of threads, nor, with running statistics (GGN_EVAL), on which images share a batch. One call at a
 * time per executor; several executors may read the same weights at once. Nothing is allocated after create.
 */
#ifndef GGN_NN_EXEC_H
#define GGN_NN_EXEC_H

#include "base/threads.h"
#include "nn/weights.h"

#define GGN_BN_EPS 1e-5
#define GGN_BN_MOMENTUM 0.1

enum ggn_mode {
    GGN_EVAL, /* running statistics, no dropout */
    GGN_TRAIN /* batch statistics (running ones are updated), dropout */
};

enum {
    GGN_EXEC_GRADS = 1,      /* room for the backward pass */
    GGN_EXEC_INPUT_GRAD = 2, /* backward also computes the gradient of the input */
    GGN_EXEC_NO_DROPOUT = 4,
    GGN_EXEC_NO_FUSE = 8, /* keep every intermediate value in GGN_EVAL too */
    GGN_EXEC_BF16 = 16    /* bfloat16 products in GGN_EVAL, if the weights hold them; float otherwise */
};

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/exec_decl.inc"
#undef REAL
#undef TYPED

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/exec_decl.inc"
#undef REAL
#undef TYPED

#endif
