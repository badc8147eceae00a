#include "nn/bf16.h"

#include "base/half.h"
#include "base/isa.h"

#define INLINE static inline __attribute__((always_inline))

/* --- the instruction's arithmetic, in software ------------------------------------------------------------------------- */

/* Denormal numbers are zero, whatever goes in and whatever comes out. */
INLINE float flushed(float x)
{
    uint32_t u = base_f32_bits(x);
    return base_f32_of_bits(u & 0x7f800000u ? u : u & 0x80000000u);
}

static uint32_t pair_of(float low, float high)
{
    return base_f32_to_bf16(flushed(low)) | (uint32_t)base_f32_to_bf16(flushed(high)) << 16;
}

static void pair_channels(uint32_t *out, const float *x0, const float *x1, long n)
{
    for (long p = 0; p < n; p++)
        out[p] = pair_of(x0[p], x1 ? x1[p] : 0);
}

/* The product of two bfloat16 numbers is a float, so that each sum is rounded once, as in the instruction. */
INLINE void add_pairs(float *acc, const uint32_t *x, uint32_t w, const int n)
{
    const float low = base_f32_of_bits(w << 16), high = base_f32_of_bits(w & 0xffff0000u);

    for (int q = 0; q < n; q++) {
        float y = flushed(acc[q] + high * base_f32_of_bits(x[q] & 0xffff0000u));
        acc[q] = flushed(y + low * base_f32_of_bits(x[q] << 16));
    }
}

INLINE void tile_of(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, long p, int ot,
                    const int n)
{
    for (int o = 0; o < ot; o++) {
        const uint32_t *wo = w + o, *xi = x;
        float acc[GGN_BF16_PX], *y = a->y[oc + o] + p;

        for (int q = 0; q < n; q++)
            acc[q] = flushed(a->bias ? a->bias[oc + o] : 0);
        for (int i = 0; i < (a->n_in + 1) / 2; i++, xi += x_stride)
            for (int k = 0; k < 9; k++, wo += ot)
                add_pairs(acc, xi + (long)(k / 3) * a->row + k % 3, *wo, n);
        for (int q = 0; q < n; q++) {
            const float sloped = a->slope * acc[q], v = a->slope != 1 && sloped > acc[q] ? sloped : acc[q];
            y[q] = a->scale ? v * a->scale[oc + o] + a->shift[oc + o] : v;
        }
    }
}

static void tile(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, long p, int ot,
                 int n)
{
    if (n == GGN_BF16_PX)
        tile_of(a, w, x, x_stride, oc, p, ot, GGN_BF16_PX);
    else
        tile_of(a, w, x, x_stride, oc, p, ot, GGN_BF16_PX_FEW);
}

/* --- convolution ------------------------------------------------------------------------------------------------------- */

static const struct ggn_bf16_form software = {pair_channels, tile};

static int processor_has_it(void)
{
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx512bf16");
#else
    return 0;
#endif
}

const char *ggn_bf16_name(void)
{
    return base_isa_best() == BASE_ISA_AVX512 && processor_has_it() ? "AVX512-BF16" : "software";
}

/* Where weight `o`, input channel i, tap k is in a packed convolution. */
static size_t packed_at(int i, int k, int o, int n_in, int n_out, int tile_oc)
{
    const int first = o / tile_oc * tile_oc, width = n_out - first < tile_oc ? n_out - first : tile_oc;
    return (size_t)first * (size_t)n_in * 9 + (size_t)((9 * i + k) * width + o - first);
}

void ggn_bf16_pack(uint32_t *out, const float *packed, int n_in, int n_out, int tile_oc)
{
    for (int oc = 0; oc < n_out; oc += GGN_BF16_OC)
        for (int i = 0; i < n_in; i += 2)
            for (int k = 0; k < 9; k++)
                for (int o = oc; o < n_out && o < oc + GGN_BF16_OC; o++)
                    *out++ = pair_of(packed[packed_at(i, k, o, n_in, n_out, tile_oc)],
                                     i + 1 < n_in ? packed[packed_at(i + 1, k, o, n_in, n_out, tile_oc)] : 0);
}

size_t ggn_bf16_scratch(int n_in, int row, long pixels)
{
    return (size_t)((n_in + 1) / 2) * ((size_t)pixels + 2 * (size_t)row + 2 * 64);
}

static void convolve(const struct ggn_bf16_form *form, const struct ggn_conv *a, const uint32_t *w, long p0, long p1,
                     int oc0, int oc1, uint32_t *scratch)
{
    const long end = (long)a->h * a->row, pairs = (a->n_in + 1) / 2, few = GGN_BF16_PX_FEW;

    if (p1 > end)
        p1 = end;
    /* rows above and below, and what the last tile reads past its end */
    const long x_stride = (p1 - p0 + 2L * a->row + 2 + GGN_BF16_PX + few - 1) / few * few;
    for (long i = 0; i < pairs; i++)
        form->pair_channels(scratch + i * x_stride, a->x[2 * i] + p0 - a->row - 1,
                            2 * i + 1 < a->n_in ? a->x[2 * i + 1] + p0 - a->row - 1 : NULL, p1 - p0 + 2L * a->row + 2);
    for (long p = p0, n; p < p1; p += n) {
        n = p1 - p <= few ? few : GGN_BF16_PX;
        for (int oc = oc0, ot; oc < oc1; oc += ot) {
            ot = oc1 - oc < GGN_BF16_OC ? oc1 - oc : GGN_BF16_OC;
            form->tile(a, w + (long)oc * pairs * 9, scratch + (p - p0), x_stride, oc, p, ot, (int)n);
        }
        for (int o = oc0; o < oc1; o++) { /* the zeros of the layout */
            for (long q = p + (a->w_px - p % a->row); q < p + n; q += a->row)
                a->y[o][q] = 0;
            for (long q = end > p ? end : p; q < p + n; q++)
                a->y[o][q] = 0;
        }
    }
}

void ggn_bf16_conv(const struct ggn_conv *a, const uint32_t *w, long p0, long p1, int oc0, int oc1, uint32_t *scratch)
{
    convolve(&software, a, w, p0, p1, oc0, oc1, scratch);
}

#if defined(__x86_64__)
void ggn_bf16_conv_avx512(const struct ggn_conv *a, const uint32_t *w, long p0, long p1, int oc0, int oc1, uint32_t *scratch)
{
    convolve(processor_has_it() ? &ggn_bf16_avx512 : &software, a, w, p0, p1, oc0, oc1, scratch);
}
#endif
