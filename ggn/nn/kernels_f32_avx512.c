/* The kernels in single precision for avx512; reached through ggn_kernels_best_f32 only. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#define REAL_IS_FLOAT 1
#define VW 16
#define TILE_OC 8
#define ISA GGN_ISA_AVX512
#define TABLE ggn_kernels_f32_avx512
#define SQRT(x) sqrtf(x)
typedef float vf __attribute__((vector_size(16 * sizeof(float))));
typedef int vi __attribute__((vector_size(16 * sizeof(float))));
#define SET1(s) ((vf)_mm512_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c)))
#define VSUM(v) _mm512_reduce_add_ps((__m512)(v))
#define KEEP(v) __asm__("" : "+v"(v))

#include "nn/kernels.inc"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
