/*
 * 3×3 convolution with bfloat16 products and float sums (VDPBF16PS), for inference on processors that have it.
 *
 * Weights and inputs are rounded to bfloat16 (8 bits of significand) as they enter a product; activations stay float in
 * memory.
 */
#ifndef GGN_NN_BF16_H
#define GGN_NN_BF16_H

#include <stddef.h>
#include <stdint.h>

#include "nn/kernels.h"

/* Whether this build and processor have it (and GGN_ISA does not forbid it). */
int ggn_bf16_available(void);

/* From a packed 3×3 convolution (ggn_conv.w): tiles of output channels as there, [n_in pairs][9][tile] pairs. */
void ggn_bf16_pack(uint32_t *out, const float *packed, int n_in, int n_out, int tile_oc);

/* Elements of scratch for ggn_bf16_conv on up to `pixels` of a plane. */
size_t ggn_bf16_scratch(int n_in, int row, long pixels);
/* As ggn_kernels.conv without a->add, for a 3×3 convolution and all output channels [oc0, oc1). */
void ggn_bf16_conv_avx512(const struct ggn_conv *a, const uint32_t *w, long p0, long p1, int oc0, int oc1,
                          uint32_t *scratch);

#endif
