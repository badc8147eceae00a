/* Numbers in bytes: little-endian integers, floats as their bits, floats of 16 bits. Pure functions. */
#ifndef BASE_BYTES_H
#define BASE_BYTES_H

#include <stdint.h>
#include <string.h>

static inline uint32_t base_get_u32(const uint8_t *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static inline uint64_t base_get_u64(const uint8_t *p) { return base_get_u32(p) | (uint64_t)base_get_u32(p + 4) << 32; }

static inline void base_put_u32(uint8_t *p, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        p[i] = (uint8_t)(v >> 8 * i);
}

static inline void base_put_u64(uint8_t *p, uint64_t v)
{
    base_put_u32(p, (uint32_t)v);
    base_put_u32(p + 4, (uint32_t)(v >> 32));
}

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

/* Floats of 16 bits: IEEE 754 binary16 (f16) and bfloat16, the upper half of a float. To nearest even; NaN stays NaN. */
uint16_t base_f32_to_bf16(float x);
float base_bf16_to_f32(uint16_t x);
uint16_t base_f32_to_f16(float x);
uint16_t base_f64_to_f16(double x); /* rounded once */
float base_f16_to_f32(uint16_t x);

#endif
