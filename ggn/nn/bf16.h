/*
 * 3×3 convolution with bfloat16 products and float sums, for inference: by VDPBF16PS where the processor has it, elsewhere
 * the same in software, slowly.
 *
 * Weights and inputs are rounded to bfloat16 (8 bits of significand, nearest even) as they enter a product; activations stay
 * float in memory. A product is exact; it is added to a float sum, which is rounded: at each tap a pair of input channels,
 * the odd one first. Denormal numbers count as zero at each step. So both ways give the same bits.
 */
#ifndef GGN_NN_BF16_H
#define GGN_NN_BF16_H

#include <stddef.h>
#include <stdint.h>

#include "nn/kernels.h"

/* Which way the best kernels go (LULL_ISA): "AVX512-BF16" or "software". */
const char *ggn_bf16_name(void);

/* Output channels and pixels of a tile; at the end of a plane, few pixels. */
enum { GGN_BF16_OC = 8, GGN_BF16_PX = 48, GGN_BF16_PX_FEW = 16 };

/* From a packed 3×3 convolution (ggn_conv.w, tiles of tile_oc output channels): tiles of GGN_BF16_OC, [n_in pairs][9][tile]
 * pairs, the even channel in the lower half. */
void ggn_bf16_pack(uint32_t *out, const float *packed, int n_in, int n_out, int tile_oc);

/* Elements of scratch for ggn_bf16_conv on up to `pixels` of a plane. */
size_t ggn_bf16_scratch(int n_in, int row, long pixels);
/* As ggn_kernels.conv without a->add, for a 3×3 convolution and all output channels [oc0, oc1). */
void ggn_bf16_conv(const struct ggn_conv *a, const uint32_t *w, long p0, long p1, int oc0, int oc1, uint32_t *scratch);
/* By the instruction, if the processor has it. */
void ggn_bf16_conv_avx512(const struct ggn_conv *a, const uint32_t *w, long p0, long p1, int oc0, int oc1,
                          uint32_t *scratch);

/* What the two ways differ in. Private to nn/bf16*.c. */
struct ggn_bf16_form {
    /* out[p] = bf16(x0[p]) | bf16(x1[p]) << 16 for at least n; x1 may be NULL: zeros. */
    void (*pair_channels)(uint32_t *out, const float *x0, const float *x1, long n);
    /* Output channels [oc, oc + ot), elements [p, p + n) of the planes; n is GGN_BF16_PX or GGN_BF16_PX_FEW. */
    void (*tile)(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, long p, int ot,
                 int n);
};
extern const struct ggn_bf16_form ggn_bf16_avx512;

#endif
