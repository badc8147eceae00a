#include "model/preprocess.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/colour.h"

/* The cleaned value; counts what was cleaned. */
static double clean(double value, struct ggn_pixel_counts *counts)
{
    uint64_t bits;

    if (value >= (double)FLT_MIN && value <= (double)GGN_PIXEL_HUGE)
        return value; /* almost always */
    memcpy(&bits, &value, sizeof bits);
    if (bits << 1 == 0)
        return 0;
    if (isnan(value))
        counts->nan++;
    else if (isinf(value))
        counts->infinite++;
    else if (fabs(value) < (double)FLT_MIN)
        counts->denormal++;
    else if (value < 0)
        counts->negative++;
    else
        counts->huge++;
    return value > (double)GGN_PIXEL_HUGE ? 1 : 0;
}

static unsigned code_by_formula(double value, const struct ggn_display *display)
{
    double encoded = display->transfer == GGN_TRANSFER_GAMMA ? pow(value, 1 / display->gamma) : value;

    return (unsigned)(255 * (encoded < 1 ? encoded : 1) + 0.5);
}

uint8_t ggn_preprocess(double linear, const struct ggn_display *display, struct ggn_pixel_counts *counts)
{
    struct ggn_pixel_counts uncounted = {0};
    double value = clean(linear, counts ? counts : &uncounted);

    if (!display)
        return base_srgb_code(value);
    value *= display->exposure;
    return display->transfer == GGN_TRANSFER_SRGB ? base_srgb_code(value) : (uint8_t)code_by_formula(value, display);
}

long ggn_pixel_counts_bad(const struct ggn_pixel_counts *counts) { return counts->nan + counts->infinite + counts->huge; }
