#include "model/preprocess.h"

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

static unsigned code_by_formula(double value, const struct ggn_display *display)
{
    double encoded = display->transfer == GGN_TRANSFER_GAMMA ? pow(value, 1 / display->gamma) : value;

    return (unsigned)(255 * (encoded < 1 ? encoded : 1) + 0.5);
}

uint8_t ggn_preprocess(double linear, const struct ggn_display *display, long *bad)
{
    double value = clean(linear, bad);

    if (!display)
        return base_srgb_code(value);
    value *= display->exposure;
    return display->transfer == GGN_TRANSFER_SRGB ? base_srgb_code(value) : (uint8_t)code_by_formula(value, display);
}
