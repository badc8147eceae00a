/* The kernels in double precision for avx2; reached through ggn_kernels_best_f64 only. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#define REAL_IS_FLOAT 0
#define VW 4
#define TILE_OC 4
#define ISA GGN_ISA_AVX2
#define TABLE ggn_kernels_f64_avx2
#define SQRT(x) sqrt(x)
typedef double vf __attribute__((vector_size(4 * sizeof(double))));
typedef long long vi __attribute__((vector_size(4 * sizeof(double))));
#define SET1(s) ((vf)_mm256_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_pd((__m256d)(a), (__m256d)(b), (__m256d)(c)))
#define VSUM(v) (((v)[0] + (v)[2]) + ((v)[1] + (v)[3]))
#define KEEP(v) __asm__("" : "+x"(v))

#include "nn/kernels.inc"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
