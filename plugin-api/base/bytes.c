#include "base/bytes.h"

#include <math.h>

uint16_t base_f32_to_bf16(float x)
{
    uint32_t u = base_f32_bits(x);
    if ((u & 0x7fffffffu) > 0x7f800000u)
        return (uint16_t)(u >> 16 | 0x40);
    return (uint16_t)((u + 0x7fff + (u >> 16 & 1)) >> 16);
}

float base_bf16_to_f32(uint16_t x) { return base_f32_of_bits((uint32_t)x << 16); }

uint16_t base_f64_to_f16(double x)
{
    uint16_t sign = signbit(x) ? 0x8000 : 0;
    double a = fabs(x);
    int exponent;

    if (isnan(x))
        return sign | 0x7e00;
    if (a >= 65520.0)
        return sign | 0x7c00;
    frexp(a, &exponent); /* a = m 2^exponent, m in [1/2, 1) */
    if (a < 0x1p-14)
        exponent = -13; /* subnormal: steps of 2^-24 */
    /* nearbyint rounds to even; a carry out of the mantissa runs into the exponent as it should */
    return (uint16_t)(sign | ((exponent + 13) * 1024 + (int)nearbyint(ldexp(a, 11 - exponent))));
}

uint16_t base_f32_to_f16(float x) { return base_f64_to_f16((double)x); }

float base_f16_to_f32(uint16_t x)
{
    uint32_t sign = (uint32_t)(x & 0x8000) << 16, e = x >> 10 & 31, m = x & 0x3ff;

    if (e == 31)
        return base_f32_of_bits(sign | 0x7f800000u | m << 13);
    if (e == 0) {
        float magnitude = (float)m / 16777216.0f;
        return sign ? -magnitude : magnitude;
    }
    return base_f32_of_bits(sign | (e + 112) << 23 | m << 13);
}
