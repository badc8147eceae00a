#include "image/tonemap.h"

#include <math.h>

double pt_srgb_encode(double x)
{
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

double pt_srgb_decode(double v)
{
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

uint8_t pt_srgb_u8(double linear)
{
    if (!(linear > 0.0))
        return 0;
    if (linear >= 1.0)
        return 255;
    return (uint8_t)(255.0 * pt_srgb_encode(linear) + 0.5);
}
