/* The kernels in single precision for avx2; reached through ggn_kernels_best_f32 only. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/kernels_tables.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#define REAL_IS_FLOAT 1
#define VW 8
#define TILE_OC 4
#define ISA GGN_ISA_AVX2
#define TABLE ggn_kernels_f32_avx2
#define SQRT(x) sqrtf(x)
typedef float vf __attribute__((vector_size(8 * sizeof(float))));
typedef int vi __attribute__((vector_size(8 * sizeof(float))));
#define SET1(s) ((vf)_mm256_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_ps((__m256)(a), (__m256)(b), (__m256)(c)))
#define VSUM(v) ((((v)[0] + (v)[4]) + ((v)[2] + (v)[6])) + (((v)[1] + (v)[5]) + ((v)[3] + (v)[7])))
#define KEEP(v) __asm__("" : "+x"(v))

#include "nn/kernels.inc"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
