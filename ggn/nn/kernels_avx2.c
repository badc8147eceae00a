/* The kernels for AVX2 with FMA: 16 registers of 32 bytes. */
#if defined(__x86_64__)
#include <immintrin.h>

#include "nn/real.h"

#define TABLE ggn_kernels_avx2
#define ISA BASE_ISA_AVX2
#define VECTOR_BYTES 32
#define TILE_OC 4
#define KEEP(v) __asm__("" : "+x"(v))
#ifdef GGN_DOUBLE
#define SET1(s) ((vf)_mm256_set1_pd(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_pd((__m256d)(a), (__m256d)(b), (__m256d)(c)))
#define VMAX(a, b) ((vf)_mm256_max_pd((__m256d)(a), (__m256d)(b)))
#define VSUM(v) (((v)[0] + (v)[2]) + ((v)[1] + (v)[3]))
#else
#define SET1(s) ((vf)_mm256_set1_ps(s))
#define FMA(a, b, c) ((vf)_mm256_fmadd_ps((__m256)(a), (__m256)(b), (__m256)(c)))
#define VMAX(a, b) ((vf)_mm256_max_ps((__m256)(a), (__m256)(b)))
#define VSUM(v) ((((v)[0] + (v)[4]) + ((v)[2] + (v)[6])) + (((v)[1] + (v)[5]) + ((v)[3] + (v)[7])))
#endif

#include "nn/vector.h"

#ifndef GGN_DOUBLE
/* What moves values between the 8 lanes of nn/winograd_body.h. */

/* Transposes the 4×4 values in the lower halves of m[0..3] and those in the upper ones. */
INLINE void transpose_halves(vf m[4])
{
    __m256d a = (__m256d)_mm256_unpacklo_ps(m[0], m[1]), b = (__m256d)_mm256_unpackhi_ps(m[0], m[1]);
    __m256d c = (__m256d)_mm256_unpacklo_ps(m[2], m[3]), d = (__m256d)_mm256_unpackhi_ps(m[2], m[3]);
    m[0] = (vf)_mm256_unpacklo_pd(a, c);
    m[1] = (vf)_mm256_unpackhi_pd(a, c);
    m[2] = (vf)_mm256_unpacklo_pd(b, d);
    m[3] = (vf)_mm256_unpackhi_pd(b, d);
}

/* p[j] lane t = row[4t + j]. */
INLINE void deinterleave4(vf p[4], const float *row)
{
    for (int i = 0; i < 4; i++)
        p[i] = _mm256_loadu2_m128(row + 16 + 4 * i, row + 4 * i);
    transpose_halves(p);
}

/* Its inverse, in place: element 4t + j of the 32 is lane t of p[j]. */
INLINE void interleave4(vf p[4])
{
    transpose_halves(p);
    vf a = p[0], b = p[1], c = p[2], d = p[3];
    p[0] = _mm256_permute2f128_ps(a, b, 0x20);
    p[1] = _mm256_permute2f128_ps(c, d, 0x20);
    p[2] = _mm256_permute2f128_ps(a, b, 0x31);
    p[3] = _mm256_permute2f128_ps(c, d, 0x31);
}

/* Lanes 1 to 7 of v, then `next`. */
INLINE vf shift_in(vf v, float next)
{
    vf rotated = _mm256_permutevar8x32_ps(v, _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0));
    return _mm256_blend_ps(rotated, SET1(next), 0x80);
}

/* m[c] = lane c of the vectors m[0..7]. */
INLINE void transpose(vf m[8])
{
    transpose_halves(m);
    transpose_halves(m + 4);
    for (int k = 0; k < 4; k++) {
        vf a = m[k], b = m[4 + k];
        m[k] = _mm256_permute2f128_ps(a, b, 0x20);
        m[4 + k] = _mm256_permute2f128_ps(a, b, 0x31);
    }
}

INLINE __m256i lanes_before(int n)
{
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(n), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
}

/* The first n values at p, 0 in the other lanes. */
INLINE vf load_part(const float *p, int n) { return n >= VW ? LOAD(p) : (vf)_mm256_maskload_ps(p, lanes_before(n)); }

/* The first n lanes. */
INLINE void store_part(float *p, int n, vf v)
{
    if (n >= VW)
        STORE(p, v);
    else
        _mm256_maskstore_ps(p, lanes_before(n), v);
}

#include "nn/winograd_body.h"

#define FASTER_FORMS .wino = wino_conv, .wino_grad = wino_grad, .wino_pack = ggn_wino_pack,
#endif

#include "nn/kernels_body.h"

#else
typedef int ggn_no_kernels_here; /* ISO C forbids an empty file */
#endif
