/* The kernels for AVX-512, with the two faster forms of a float convolution. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/bf16.h"
#include "nn/real.h"
#include "nn/winograd.h"

#define TABLE ggn_kernels_avx512
#define ISA GGN_ISA_AVX512
#define VECTOR_BYTES 64
#define TILE_OC 8
#define KEEP(v) __asm__("" : "+v"(v))
#ifdef GGN_DOUBLE
#define SET1(s) ((vf)_mm512_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_pd((__m512d)(a), (__m512d)(b), (__m512d)(c)))
#define VSUM(v) _mm512_reduce_add_pd((__m512d)(v))
#else
#define SET1(s) ((vf)_mm512_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c)))
#define VSUM(v) _mm512_reduce_add_ps((__m512)(v))
#define FASTER_FORMS                                                                                                        \
    .wino = ggn_wino_conv_avx512, .wino_grad = ggn_wino_grad_avx512, .wino_pack = ggn_wino_pack,                            \
    .bf16 = ggn_bf16_conv_avx512, .bf16_pack = ggn_bf16_pack,
#endif

#include "nn/kernels_body.h"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
