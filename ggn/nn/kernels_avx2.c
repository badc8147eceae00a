/* The kernels for AVX2 with FMA. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/bf16.h"
#include "nn/real.h"

#define TABLE ggn_kernels_avx2
#define ISA GGN_ISA_AVX2
#define VECTOR_BYTES 32
#define TILE_OC 4
#define KEEP(v) __asm__("" : "+x"(v))
#ifdef GGN_DOUBLE
#define SET1(s) ((vf)_mm256_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_pd((__m256d)(a), (__m256d)(b), (__m256d)(c)))
#define VSUM(v) (((v)[0] + (v)[2]) + ((v)[1] + (v)[3]))
#else
#define SET1(s) ((vf)_mm256_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_ps((__m256)(a), (__m256)(b), (__m256)(c)))
#define VSUM(v) ((((v)[0] + (v)[4]) + ((v)[2] + (v)[6])) + (((v)[1] + (v)[5]) + ((v)[3] + (v)[7])))
#define FASTER_FORMS .bf16 = ggn_bf16_conv, .bf16_pack = ggn_bf16_pack,
#endif

#include "nn/kernels_body.h"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
