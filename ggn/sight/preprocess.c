#include "sight/preprocess.h"

#include <float.h>
#include <math.h>

#include "base/colour.h"

/* The cleaned value. */
static double clean(double value, long *bad)
{
    if (value >= (double)FLT_MIN && value <= (double)GGN_PIXEL_HUGE)
        return value; /* almost always */
    const int huge = value > (double)GGN_PIXEL_HUGE;
    if (bad)
        *bad += huge || !isfinite(value);
    return huge;
}

uint8_t ggn_preprocess(double linear, const struct ggn_display *display, long *bad)
{
    double value = clean(linear, bad);
    if (!display)
        return base_srgb_code(value);
    value *= display->exposure;
    if (display->transfer == GGN_TRANSFER_SRGB)
        return base_srgb_code(value);
    if (display->transfer == GGN_TRANSFER_GAMMA)
        value = pow(value, 1 / display->gamma);
    return (uint8_t)(255 * (value < 1 ? value : 1) + 0.5);
}
