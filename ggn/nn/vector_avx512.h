/* Vectors of AVX-512: 32 registers of 64 bytes. */
#ifndef GGN_NN_VECTOR_AVX512_H
#define GGN_NN_VECTOR_AVX512_H

#include <immintrin.h>

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

#endif
