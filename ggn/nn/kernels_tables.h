/* The tables behind ggn_kernels_for_f32 and ggn_kernels_for_f64; private to nn/kernels*.c. */
#ifndef GGN_NN_KERNELS_TABLES_H
#define GGN_NN_KERNELS_TABLES_H

#include "nn/kernels.h"

extern const struct ggn_kernels_f32 ggn_kernels_f32_base, ggn_kernels_f32_avx2, ggn_kernels_f32_avx512;
extern const struct ggn_kernels_f64 ggn_kernels_f64_base, ggn_kernels_f64_avx2, ggn_kernels_f64_avx512;

#endif
