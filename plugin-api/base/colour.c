#include "base/colour.h"

#include <math.h>

double base_srgb_linear[256], base_srgb_limit[257];
float base_srgb_linear_f32[256];
uint8_t base_srgb_bin[BASE_SRGB_BINS];

double base_srgb_oetf(double linear)
{
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1.0 / 2.4) - 0.055;
}

double base_srgb_eotf(double encoded) { return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4); }

/* A number to some 30 digits: the nearest double, and what that lacks (Dekker 1971). */
struct exact {
    double near, rest;
};

/* Of numbers of which the second is much the smaller. */
static struct exact sum(double a, double b)
{
    const double near = a + b;
    return (struct exact){near, b - (near - a)};
}

static struct exact quotient(double a, double b)
{
    const double near = a / b;
    return (struct exact){near, fma(-near, b, a) / b};
}

static struct exact power(struct exact x, int exponent)
{
    struct exact p = x;
    for (; exponent > 1; exponent--) {
        const double near = p.near * x.near;
        p = sum(near, fma(p.near, x.near, -near) + (p.near * x.rest + p.rest * x.near));
    }
    return p;
}

/* eotf(n / 510): of codes where n is even, half way between two where it is odd. */
static struct exact light_of(int n)
{
    if (n <= 20)                       /* 0.04045 · 510 = 20.6 */
        return quotient(5 * n, 32946); /* n / 510 / 12.92 */
    /* ((n / 510 + 0.055) / 1.055)^2.4 is the fifth root of a twelfth power: the C library's, and one step of Newton's */
    const struct exact wanted = power(quotient(100 * n + 2805, 53805), 12);
    const double root = pow(wanted.near, 0.2);
    const struct exact reached = power((struct exact){root, 0.0}, 5);
    const double lacking = wanted.near - reached.near + (wanted.rest - reached.rest);
    return sum(root, lacking * root / (5.0 * reached.near));
}

/* Before main, or when a library that has these tables is loaded: whoever converts light finds them filled. */
__attribute__((constructor)) static void fill_tables(void)
{
    int code = 0;
    for (int i = 0; i < 256; i++) {
        const struct exact limit = light_of(2 * i - 1);
        base_srgb_linear[i] = light_of(2 * i).near;
        base_srgb_linear_f32[i] = (float)base_srgb_linear[i];
        base_srgb_limit[i] = i == 0 ? 0.0 : limit.rest > 0.0 ? nextafter(limit.near, 1.0) : limit.near;
    }
    base_srgb_limit[256] = (double)INFINITY;
    for (uint64_t bin = 0; bin < BASE_SRGB_BINS; bin++) {
        const uint64_t bits = BASE_SRGB_FIRST_BITS + (bin << BASE_SRGB_BIN_BITS);
        double start;
        memcpy(&start, &bits, sizeof start);
        while (start >= base_srgb_limit[code + 1])
            code++;
        base_srgb_bin[bin] = (uint8_t)code;
    }
}
