/*
 * The numbers of a network: parameters, running statistics, and the packed form that the kernels read.
 *
 * After ggn_weights_pack an object may be read by any number of executors and threads until params, mean or var change.
 */
#ifndef GGN_NN_WEIGHTS_H
#define GGN_NN_WEIGHTS_H

#include <stdlib.h>

#include "base/threads.h"
#include "nn/graph.h"
#include "nn/kernels.h"

#define GGN_BN_EPS 1e-5

enum {
    GGN_WEIGHTS_BACKWARD = 1 /* also packed for the backward pass */
};

enum ggn_init {
    GGN_INIT_HASH,  /* golden values: tensor i is hashed with seed base + i */
    GGN_INIT_PAPER, /* U(±1/√fan_in); batch norm 1 and 0 */
    GGN_INIT_GAN,   /* the discriminator's: convolutions N(0, 0.02), BN weights N(1, 0.02), the rest as PAPER */
    GGN_INIT_HE     /* N(0, √(2/((1 + 0.2²)·fan_in))), biases 0: keeps the variance through LeakyReLU(0.2) */
};

struct ggn_weights {
    const struct ggn_graph *graph;     /* borrows until destroy */
    const struct ggn_kernels *kernels; /* static */
    real *params;                      /* behind this struct, as all arrays are; [n_learned]: parameters, mean, var */
    real *mean, *var;                  /* [n_stats] running statistics; inside params */
    real *pack, *pack_back;            /* [n_pack] for the forward and the backward pass; pack_back may be NULL */
    real *wino, *wino_back;            /* [4·n_pack] transformed for nn/winograd.h; NULL where it is not used */
    real *scale, *shift;               /* [n_stats] batch norm with running statistics as y = x·scale + shift */
};

/* Zero parameters, running mean 0 and variance 1. `flags`: GGN_WEIGHTS_*.
 * `kernels` NULL = the best ones. NULL on failure. */
struct ggn_weights *ggn_weights_create(const struct ggn_graph *graph, const struct ggn_kernels *kernels, int flags,
                                       struct base_err *err);
static inline void ggn_weights_destroy(struct ggn_weights *weights) { free(weights); }

/* Fills params; the same seed gives the same numbers everywhere. Resets the running statistics. */
void ggn_weights_init(struct ggn_weights *weights, enum ggn_init init, uint32_t seed);

/* Takes over parameters and running statistics, [n_learned] as in params, and packs. */
void ggn_weights_copy(struct ggn_weights *weights, const float *learned);

/* Brings the packed form up to date, on a pool of threads (NULL: the calling one): call after params, mean or var have
 * changed, before the next forward pass. */
void ggn_weights_pack(struct ggn_weights *weights, struct base_threads *threads);

#endif
