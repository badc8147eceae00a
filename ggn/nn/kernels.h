/*
 * The inner loops of the networks, for float and double, compiled for several instruction sets and chosen at run time.
 *
 * The declarations are in kernels_decl.inc, included once per precision with the suffixes _f32 and _f64. All functions work
 * on planes as nn/graph.h lays them out, are pure (no globals, no allocation) and thread-safe. A result never depends on how
 * a caller divides the work. Different instruction sets may differ in the last bits.
 */
#ifndef GGN_NN_KERNELS_H
#define GGN_NN_KERNELS_H

#include "nn/typed.h"

enum {
    GGN_TILE_MAX = 8, /* most output channels of a register tile */
    GGN_GRAD_IC = 16, /* input channels whose weight gradient one task accumulates */
    GGN_SSIM_RADIUS = 5
};

/* Instruction sets, weakest first. */
enum ggn_isa { GGN_ISA_BASE, GGN_ISA_AVX2, GGN_ISA_AVX512, GGN_ISA_COUNT };

const char *ggn_isa_name(enum ggn_isa isa);
/* Whether this build and this processor have it; BASE always is. */
int ggn_isa_available(enum ggn_isa isa);
/* The best one available; the environment variable GGN_ISA=base|avx2|avx512 lowers it. */
enum ggn_isa ggn_isa_best(void);

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/kernels_decl.inc"
#undef REAL
#undef TYPED

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/kernels_decl.inc"
#undef REAL
#undef TYPED

#endif
