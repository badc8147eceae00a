/* The kernels for AVX2 with FMA. */
#if defined(__x86_64__)
#include "nn/real.h"
#include "nn/vector_avx2.h"
#include "nn/winograd.h"

#define TABLE ggn_kernels_avx2
#define ISA BASE_ISA_AVX2
#ifndef GGN_DOUBLE
#define FASTER_FORMS .wino = ggn_wino_conv_avx2, .wino_grad = ggn_wino_grad_avx2, .wino_pack = ggn_wino_pack,
#endif

#include "nn/kernels_body.h"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
