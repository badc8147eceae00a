/* The kernels for AVX-512: 32 registers of 64 bytes. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/real.h"

#define TABLE ggn_kernels_avx512
#define ISA BASE_ISA_AVX512
#define VECTOR_BYTES 64
#define TILE_OC 8
#define KEEP(v) __asm__("" : "+v"(v))
#ifdef GGN_DOUBLE
#define SET1(s) ((vf)_mm512_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_pd((__m512d)(a), (__m512d)(b), (__m512d)(c)))
#define VMAX(a, b) ((vf)_mm512_max_pd((__m512d)(a), (__m512d)(b)))
#define VSUM(v) _mm512_reduce_add_pd((__m512d)(v))
#else
#define SET1(s) ((vf)_mm512_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c)))
#define VMAX(a, b) ((vf)_mm512_max_ps((__m512)(a), (__m512)(b)))
#define VSUM(v) _mm512_reduce_add_ps((__m512)(v))
#endif

#include "nn/vector.h"

#ifndef GGN_DOUBLE
/* What moves values between the 16 lanes of nn/winograd_body.h. */

/* p[j] lane t = row[4t + j]. */
INLINE void deinterleave4(vf p[4], const float *row)
{
    const __m512i low = _mm512_set_epi32(29, 25, 21, 17, 13, 9, 5, 1, 28, 24, 20, 16, 12, 8, 4, 0);
    const __m512i high = _mm512_set_epi32(31, 27, 23, 19, 15, 11, 7, 3, 30, 26, 22, 18, 14, 10, 6, 2);
    vf a = LOAD(row), b = LOAD(row + 16), c = LOAD(row + 32), d = LOAD(row + 48);
    vf ab0 = _mm512_permutex2var_ps(a, low, b), ab2 = _mm512_permutex2var_ps(a, high, b);
    vf cd0 = _mm512_permutex2var_ps(c, low, d), cd2 = _mm512_permutex2var_ps(c, high, d);
    p[0] = _mm512_shuffle_f32x4(ab0, cd0, 0x44);
    p[1] = _mm512_shuffle_f32x4(ab0, cd0, 0xee);
    p[2] = _mm512_shuffle_f32x4(ab2, cd2, 0x44);
    p[3] = _mm512_shuffle_f32x4(ab2, cd2, 0xee);
}

/* Its inverse, in place: element 4t + j of the 64 is lane t of p[j]. */
INLINE void interleave4(vf p[4])
{
    /* pairs of phases, then pairs of pairs; each 128-bit part holds one tile */
    const __m512i first = _mm512_set_epi32(23, 7, 22, 6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
    const __m512i second = _mm512_set_epi32(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8);
    __m512d a01 = (__m512d)_mm512_permutex2var_ps(p[0], first, p[1]);
    __m512d b01 = (__m512d)_mm512_permutex2var_ps(p[0], second, p[1]);
    __m512d a23 = (__m512d)_mm512_permutex2var_ps(p[2], first, p[3]);
    __m512d b23 = (__m512d)_mm512_permutex2var_ps(p[2], second, p[3]);
    const __m512i low = _mm512_set_epi64(11, 3, 10, 2, 9, 1, 8, 0), high = _mm512_set_epi64(15, 7, 14, 6, 13, 5, 12, 4);
    p[0] = (vf)_mm512_permutex2var_pd(a01, low, a23);
    p[1] = (vf)_mm512_permutex2var_pd(a01, high, a23);
    p[2] = (vf)_mm512_permutex2var_pd(b01, low, b23);
    p[3] = (vf)_mm512_permutex2var_pd(b01, high, b23);
}

/* Lanes 1 to 15 of v, then `next`. */
INLINE vf shift_in(vf v, float next) { return (vf)_mm512_alignr_epi32((__m512i)SET1(next), (__m512i)v, 1); }

/* m[c] = lane c of the vectors m[0..15]. */
INLINE void transpose(vf m[16])
{
    vf t[16];
    for (int i = 0; i < 16; i += 2) {
        t[i] = _mm512_unpacklo_ps(m[i], m[i + 1]);
        t[i + 1] = _mm512_unpackhi_ps(m[i], m[i + 1]);
    }
    for (int i = 0; i < 16; i += 4)
        for (int k = 0; k < 2; k++) {
            __m512d a = (__m512d)t[i + k], b = (__m512d)t[i + k + 2];
            m[i + 2 * k] = (vf)_mm512_unpacklo_pd(a, b);
            m[i + 2 * k + 1] = (vf)_mm512_unpackhi_pd(a, b);
        }
    for (int k = 0; k < 4; k++) { /* m[4i + k]: columns k, k+4, k+8, k+12 of rows 4i to 4i+3, in this order */
        vf a = _mm512_shuffle_f32x4(m[k], m[4 + k], 0x88), b = _mm512_shuffle_f32x4(m[k], m[4 + k], 0xdd);
        vf c = _mm512_shuffle_f32x4(m[8 + k], m[12 + k], 0x88), d = _mm512_shuffle_f32x4(m[8 + k], m[12 + k], 0xdd);
        t[k] = _mm512_shuffle_f32x4(a, c, 0x88);
        t[8 + k] = _mm512_shuffle_f32x4(a, c, 0xdd);
        t[4 + k] = _mm512_shuffle_f32x4(b, d, 0x88);
        t[12 + k] = _mm512_shuffle_f32x4(b, d, 0xdd);
    }
    for (int i = 0; i < 16; i++)
        m[i] = t[i];
}

/* The first n values at p, 0 in the other lanes. */
INLINE vf load_part(const float *p, int n) { return _mm512_maskz_loadu_ps((__mmask16)((1u << n) - 1), p); }

/* The first n lanes. */
INLINE void store_part(float *p, int n, vf v) { _mm512_mask_storeu_ps(p, (__mmask16)((1u << n) - 1), v); }

#include "nn/winograd_body.h"

#define FASTER_FORMS .wino = wino_conv, .wino_grad = wino_grad, .wino_pack = ggn_wino_pack,
#endif

#include "nn/kernels_body.h"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
