/* Vectors of AVX2 with FMA: 16 registers of 32 bytes. */
#ifndef GGN_NN_VECTOR_AVX2_H
#define GGN_NN_VECTOR_AVX2_H

#include <immintrin.h>

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

#endif
