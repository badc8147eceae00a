/*
 * Vectors of `real` for the bodies of kernels, through the compiler's vector extension. Left alone they have 16 bytes, which
 * any processor has. nn/kernels_avx2.c and nn/kernels_avx512.c define before they include it: VECTOR_BYTES, TILE_OC (8 or 4
 * output channels in a register tile), SET1, FMA, VMAX (b where either is not a number), VSUM (sum of the lanes) and KEEP.
 * KEEP(v) makes the compiler hold v in a register: left alone it folds a load that feeds three multiply-adds into each of
 * them, and loads become the bottleneck. UNROLL before a short loop over an array of vectors lets it live in registers from
 * the first line on.
 */
#ifndef GGN_NN_VECTOR_H
#define GGN_NN_VECTOR_H

#include <stdint.h>

#include "nn/real.h"

#ifndef VECTOR_BYTES
#define VECTOR_BYTES 16
#define TILE_OC 4
#define FMA(a, b, c) ((a) * (b) + (c))
#define KEEP(v) ((void)(v))
#ifdef GGN_DOUBLE
#define SET1(s) ((vf){(s), (s)})
#define VSUM(v) ((v)[0] + (v)[1])
#else
#define SET1(s) ((vf){(s), (s), (s), (s)})
#define VSUM(v) (((v)[0] + (v)[2]) + ((v)[1] + (v)[3]))
#endif
#endif

#ifdef GGN_DOUBLE
typedef int64_t lane_mask;
#else
typedef int32_t lane_mask;
#endif
typedef real vf __attribute__((vector_size(VECTOR_BYTES)));
typedef lane_mask vi __attribute__((vector_size(VECTOR_BYTES)));
typedef vf vfu __attribute__((aligned(sizeof(real)), may_alias));

enum { VW = VECTOR_BYTES / (int)sizeof(real) /* lanes */ };

#define LOAD(p) ((vf) * (const vfu *)(p))
#define STORE(p, v) (*(vfu *)(p) = (vfu)(v))
#ifdef __clang__
#define UNROLL _Pragma("clang loop unroll(full)")
#else
#define UNROLL _Pragma("GCC unroll 8")
#endif
#define INLINE static inline __attribute__((always_inline))

/* a in the lanes where m is −1, b where it is 0. */
INLINE vf vector_select(vi m, vf a, vf b) { return (vf)(((vi)a & m) | ((vi)b & ~m)); }

/* X(channels) for each number of output channels that a register tile may have. */
#if TILE_OC == 8
#define EACH_OT(X) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8)
#else
#define EACH_OT(X) X(1) X(2) X(3) X(4)
#endif

#ifndef VMAX
#define VMAX(a, b) vector_select((a) > (b), a, b)
#endif

#endif
