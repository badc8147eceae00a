/*
 * The numbers of a network: parameters, running statistics, and the packed form that the kernels read.
 *
 * Declared in weights_decl.inc for float (_f32) and double (_f64). After ggn_weights_pack an object may be read by any
 * number of executors and threads until params, mean or var change.
 */
#ifndef GGN_NN_WEIGHTS_H
#define GGN_NN_WEIGHTS_H

#include "base/threads.h"
#include "nn/graph.h"
#include "nn/kernels.h"

/* The hash of the golden values, also the library's random numbers: h(k, s) and u(k, s) = h / 2^32 in [0, 1). */
uint32_t ggn_hash(uint32_t k, uint32_t s);
double ggn_hash_unit(uint32_t k, uint32_t s);

enum {
    GGN_WEIGHTS_BACKWARD = 1, /* also packed for the backward pass */
    GGN_WEIGHTS_BF16 = 2      /* also packed in bfloat16, where the processor has it */
};

enum ggn_init {
    GGN_INIT_HASH,  /* golden values: tensor i is hashed with seed base + i */
    GGN_INIT_PAPER, /* U(±1/√fan_in); batch norm 1 and 0 */
    GGN_INIT_GAN,   /* the discriminator's: convolutions N(0, 0.02), BN weights N(1, 0.02), the rest as PAPER */
    GGN_INIT_HE     /* N(0, √(2/((1 + 0.2²)·fan_in))), biases 0: keeps the variance through LeakyReLU(0.2) */
};

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/weights_decl.inc"
#undef REAL
#undef TYPED

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/weights_decl.inc"
#undef REAL
#undef TYPED

#endif
