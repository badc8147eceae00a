#include "model/preprocess.h"

#include <math.h>
#include <string.h>

#include "model/srgb_table.h"

enum { BIN_BITS = 16 };

/* The code of a clean value: the table of the sRGB curve's 255 rounding points, entered through the top bits of the float. A
 * bin of the index is so narrow that the code grows by at most one inside it. */
static unsigned code_of(uint32_t bits)
{
    if (bits >= 0x3f800000u) /* ≥ 1 */
        return 255;
    if (bits < GGN_SRGB_FIRST_BITS)
        return 0;
    unsigned code = ggn_srgb_bin[(bits - GGN_SRGB_FIRST_BITS) >> BIN_BITS];
    return code + (bits >= ggn_srgb_limit[code + 1]);
}

/* The bits of the cleaned value; counts what was cleaned. */
static uint32_t clean(uint32_t bits, struct ggn_pixel_counts *counts)
{
    uint32_t magnitude = bits & 0x7fffffffu, huge;
    const float limit = GGN_PIXEL_HUGE;

    memcpy(&huge, &limit, sizeof huge);
    if (magnitude - 0x00800000u < 0x7f800000u - 0x00800000u && bits == magnitude && magnitude <= huge)
        return bits; /* positive and normal: almost always */
    if (magnitude == 0)
        return 0;
    if (magnitude > 0x7f800000u) {
        counts->nan++;
        return 0;
    }
    if (magnitude == 0x7f800000u)
        counts->infinite++;
    else if (magnitude < 0x00800000u)
        counts->denormal++;
    else if (bits != magnitude)
        counts->negative++;
    else
        counts->huge++;
    return bits == magnitude && magnitude >= 0x00800000u ? 0x3f800000u : 0;
}

static unsigned code_by_formula(double value, const struct ggn_display *display)
{
    double encoded = display->transfer == GGN_TRANSFER_GAMMA ? pow(value, 1 / display->gamma) : value;

    return (unsigned)(255 * (encoded < 1 ? encoded : 1) + 0.5);
}

uint8_t ggn_preprocess(double linear, const struct ggn_display *display, struct ggn_pixel_counts *counts)
{
    struct ggn_pixel_counts uncounted = {0};
    float value = (float)linear;
    uint32_t bits;

    memcpy(&bits, &value, sizeof bits);
    bits = clean(bits, counts ? counts : &uncounted);
    if (!display || !bits)
        return (uint8_t)code_of(bits);
    memcpy(&value, &bits, sizeof value);
    double exposed = (double)value * display->exposure;
    if (display->transfer != GGN_TRANSFER_SRGB)
        return (uint8_t)code_by_formula(exposed, display);
    value = (float)exposed;
    memcpy(&bits, &value, sizeof bits);
    return (uint8_t)code_of(bits);
}

long ggn_pixel_counts_bad(const struct ggn_pixel_counts *counts)
{
    return counts->nan + counts->infinite + counts->huge;
}
