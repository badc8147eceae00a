/* The bfloat16 convolution for AVX512-BF16; see nn/bf16.h. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/bf16.h"

enum { L = GGN_BF16_PX_FEW, TILE_V = GGN_BF16_PX / L };

typedef __m512 vf;
#define INLINE static inline __attribute__((always_inline))

/* Pairs of channels side by side: out[p] = bf16(x0[p]) | bf16(x1[p]) << 16. */
static void pair_channels(uint32_t *out, const float *x0, const float *x1, long n)
{
    const __m512i interleave = _mm512_set_epi16(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8, 23, 7, 22, 6,
                                                21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);

    for (long p = 0; p < n; p += L) {
        vf low = _mm512_loadu_ps(x0 + p), high = x1 ? _mm512_loadu_ps(x1 + p) : _mm512_setzero_ps();
        __m512i both = (__m512i)_mm512_cvtne2ps_pbh(high, low);
        _mm512_storeu_si512(out + p, _mm512_permutexvar_epi16(interleave, both));
    }
}

INLINE void tile(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, long p, const int ot,
                 const int nv)
{
    vf acc[8][TILE_V];

    for (int o = 0; o < ot; o++)
        for (int v = 0; v < nv; v++)
            acc[o][v] = _mm512_set1_ps(a->bias ? a->bias[oc + o] : 0);
    for (int i = 0; i < (a->n_in + 1) / 2; i++, x += x_stride)
        for (int ky = 0; ky < 3; ky++)
            for (int kx = 0; kx < 3; kx++, w += ot) {
                __m512i xv[TILE_V];
                for (int v = 0; v < nv; v++)
                    xv[v] = _mm512_loadu_si512(x + (long)ky * a->row + kx + v * L);
                for (int o = 0; o < ot; o++) {
                    __m512i wo = _mm512_set1_epi32((int)w[o]);
                    __asm__("" : "+v"(wo)); /* loaded once, not once per product */
                    for (int v = 0; v < nv; v++)
                        acc[o][v] = _mm512_dpbf16_ps(acc[o][v], (__m512bh)xv[v], (__m512bh)wo);
                }
            }
    for (int o = 0; o < ot; o++)
        for (int v = 0; v < nv; v++) {
            vf y = acc[o][v];
            if (a->slope != 1)
                y = _mm512_max_ps(y, _mm512_mul_ps(_mm512_set1_ps(a->slope), y));
            if (a->scale) /* not fused: the same bits as in software */
                y = _mm512_add_ps(_mm512_mul_ps(y, _mm512_set1_ps(a->scale[oc + o])), _mm512_set1_ps(a->shift[oc + o]));
            _mm512_storeu_ps(a->y[oc + o] + p + v * L, y);
        }
}

#define TILE(OT, NV) \
    static void tile_##OT##_##NV(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, \
                                 long p) \
    { \
        tile(a, w, x, x_stride, oc, p, OT, NV); \
    }
#define TILES(OT) TILE(OT, 1) TILE(OT, 3)
TILES(1)
TILES(2)
TILES(3)
TILES(4)
TILES(5)
TILES(6)
TILES(7)
TILES(8)

static void any_tile(const struct ggn_conv *a, const uint32_t *w, const uint32_t *x, long x_stride, int oc, long p, int ot,
                     int n)
{
    typedef void tile_fn(const struct ggn_conv *, const uint32_t *, const uint32_t *, long, int, long);
#define ROW(NV) \
    { \
        tile_1_##NV, tile_2_##NV, tile_3_##NV, tile_4_##NV, tile_5_##NV, tile_6_##NV, tile_7_##NV, tile_8_##NV \
    }
    static tile_fn *const tiles[2][GGN_BF16_OC] = {ROW(3), ROW(1)};

    tiles[n == GGN_BF16_PX_FEW][ot - 1](a, w, x, x_stride, oc, p);
}

const struct ggn_bf16_form ggn_bf16_avx512 = {pair_channels, any_tile};

#else
typedef int ggn_no_bf16_here; /* ISO C forbids an empty file */
#endif
