/*
 * Linear light with the primaries and the white of sRGB (IEC 61966-2-1), its luminance, and the codes that a display shows.
 * Pure functions, thread-safe.
 */
#ifndef BASE_COLOUR_H
#define BASE_COLOUR_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Row major, XYZ = M · RGB, white (0.9504700, 1, 1.0888300). All luminances of the project have the weights of row 2: the
 * mean of a film and its second moment must agree to the last digit, or a pixel without noise gets an error. */
#define BASE_RGB_TO_XYZ                                                                                                    \
    {0.4124564, 0.3575761, 0.1804375, BASE_LUMINANCE_R, BASE_LUMINANCE_G, BASE_LUMINANCE_B, 0.0193339, 0.1191920, 0.9503041}
#define BASE_LUMINANCE_R 0.2126729
#define BASE_LUMINANCE_G 0.7151522
#define BASE_LUMINANCE_B 0.0721750

static inline double base_luminance(double r, double g, double b)
{
    return BASE_LUMINANCE_R * r + BASE_LUMINANCE_G * g + BASE_LUMINANCE_B * b;
}

/* The transfer function: [0, 1] to [0, 1], and its inverse. */
double base_srgb_oetf(double linear);
double base_srgb_eotf(double encoded);
float base_srgb_eotf_f32(float encoded); /* in float throughout */
/* floor(255 oetf(clamp(linear, 0, 1)) + 0.5); NaN gives 0. */
uint8_t base_srgb_code(double linear);

#ifdef __cplusplus
}
#endif

#endif
