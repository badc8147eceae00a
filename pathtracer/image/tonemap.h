/* Linear light to display codes: the sRGB transfer function (IEC 61966-2-1), no exposure, no curve. Pure functions. */
#ifndef PT_IMAGE_TONEMAP_H
#define PT_IMAGE_TONEMAP_H

#include <stdint.h>

double pt_srgb_encode(double linear); /* [0, 1] to [0, 1] */
double pt_srgb_decode(double code);   /* its inverse */
/* floor(255 oetf(clamp(linear, 0, 1)) + 0.5); NaN gives 0. */
uint8_t pt_srgb_u8(double linear);

#endif
