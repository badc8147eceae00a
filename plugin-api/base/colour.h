/*
 * Linear light with the primaries and the white of sRGB (IEC 61966-2-1), its luminance, and the codes that a display shows.
 * Pure functions, thread-safe.
 */
#ifndef BASE_COLOUR_H
#define BASE_COLOUR_H

#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Row major, XYZ = M · RGB, white (0.9504700, 1, 1.0888300). All luminances of the project have the weights of row 2: the
 * mean of a film and its second moment must agree to the last digit, or a pixel without noise gets an error. */
#define BASE_RGB_TO_XYZ \
    { \
        0.4124564, 0.3575761, 0.1804375, BASE_LUMINANCE_R, BASE_LUMINANCE_G, BASE_LUMINANCE_B, 0.0193339, 0.1191920, \
            0.9503041 \
    }
#define BASE_LUMINANCE_R 0.2126729
#define BASE_LUMINANCE_G 0.7151522
#define BASE_LUMINANCE_B 0.0721750

static inline double base_luminance(double r, double g, double b)
{
    return BASE_LUMINANCE_R * r + BASE_LUMINANCE_G * g + BASE_LUMINANCE_B * b;
}

/* The transfer function: [0, 1] to [0, 1], and its inverse. For values between codes: the last digits are those of the C
 * library, which may differ from one processor to the next. */
double base_srgb_oetf(double linear);
double base_srgb_eotf(double encoded);

/* Tables that are filled before main, and that nobody writes to. */

/* [code]: eotf(code / 255), rounded to the nearest. */
extern double base_srgb_linear[256];
extern float base_srgb_linear_f32[256];
/* [code]: the smallest double whose 8-bit code is `code`, where 255 oetf(x) reaches code - 1/2, to the last bit. [0] is 0,
 * [256] is infinite. */
extern double base_srgb_limit[257];

/* The code at the start of each bin: the top bits of a double, from those of the first limit up to those of 1. A bin is so
 * narrow that the code grows by at most one inside it. */
enum { BASE_SRGB_BINS = 1633, BASE_SRGB_BIN_BITS = 45 };
#define BASE_SRGB_FIRST_BITS 0x3f23e00000000000u
extern uint8_t base_srgb_bin[BASE_SRGB_BINS];

/* What a display shows for linear light: floor(255 oetf(clamp(linear, 0, 1)) + 0.5); NaN gives 0. The only way from light to
 * such codes: compared with exact limits and rounded to no other type before, so that two programs that have the same mean
 * have the same code, on every processor. */
static inline uint8_t base_srgb_code(double linear)
{
    uint64_t bits;

    memcpy(&bits, &linear, sizeof bits);
    uint64_t bin = (bits - BASE_SRGB_FIRST_BITS) >> BASE_SRGB_BIN_BITS;
    if (bin >= BASE_SRGB_BINS) /* below the first limit, negative, at least 1 or no number */
        return linear >= 1.0 ? 255 : 0;
    uint8_t code = base_srgb_bin[bin];
    return (uint8_t)(code + (linear >= base_srgb_limit[code + 1]));
}

#ifdef __cplusplus
}
#endif

#endif
