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

void ggn_preprocess(const struct ggn_linear_view *view, uint8_t *out, struct ggn_pixel_counts *counts)
{
    struct ggn_pixel_counts local = {0};

    for (int c = 0; c < 3; c++)
        for (int y = 0; y < view->h; y++) {
            const float *p = view->data + c * view->channel + y * view->row;
            for (int x = 0; x < view->w; x++, p += view->pixel) {
                uint32_t bits;
                memcpy(&bits, p, sizeof bits);
                bits = clean(bits, &local);
                if (bits && view->exposure != 1) {
                    float value;
                    memcpy(&value, &bits, sizeof value);
                    value *= view->exposure;
                    memcpy(&bits, &value, sizeof bits);
                }
                *out++ = (uint8_t)code_of(bits);
            }
        }
    if (counts) {
        counts->nan += local.nan;
        counts->infinite += local.infinite;
        counts->negative += local.negative;
        counts->huge += local.huge;
        counts->denormal += local.denormal;
    }
}

long ggn_pixel_counts_bad(const struct ggn_pixel_counts *counts)
{
    return counts->nan + counts->infinite + counts->huge;
}
