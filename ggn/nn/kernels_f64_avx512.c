/* The kernels in double precision for avx512; reached through ggn_kernels_best_f64 only. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#define REAL_IS_FLOAT 0
#define VW 8
#define TILE_OC 8
#define ISA GGN_ISA_AVX512
#define TABLE ggn_kernels_f64_avx512
#define SQRT(x) sqrt(x)
typedef double vf __attribute__((vector_size(8 * sizeof(double))));
typedef long long vi __attribute__((vector_size(8 * sizeof(double))));
#define SET1(s) ((vf)_mm512_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_pd((__m512d)(a), (__m512d)(b), (__m512d)(c)))
#define VSUM(v) _mm512_reduce_add_pd((__m512d)(v))
#define KEEP(v) __asm__("" : "+v"(v))

#include "nn/kernels.inc"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
