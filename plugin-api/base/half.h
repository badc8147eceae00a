/* Floats of 16 bits: IEEE 754 binary16 (f16) and bfloat16, the upper half of a float. */
#ifndef BASE_HALF_H
#define BASE_HALF_H

#include <stdint.h>
#include <string.h>

/* A float as its bits, and the other way round. */
static inline uint32_t base_f32_bits(float x)
{
    uint32_t u;
    memcpy(&u, &x, sizeof u);
    return u;
}

static inline float base_f32_of_bits(uint32_t u)
{
    float x;
    memcpy(&x, &u, sizeof x);
    return x;
}

/* Rounds to nearest even; NaN stays NaN. */
uint16_t base_f32_to_bf16(float x);
float base_bf16_to_f32(uint16_t x);
uint16_t base_f32_to_f16(float x);
uint16_t base_f64_to_f16(double x); /* rounded once */
float base_f16_to_f32(uint16_t x);

#endif
