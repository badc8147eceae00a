/*
 * From linear radiance to what the networks see: the one conversion that training data and inference share.
 *
 * Linear RGB, times exposure, cleaned, sRGB transfer curve (IEC 61966-2-1), rounded to 8 bits. Network inputs are these
 * bytes divided by 255. Cleaning: NaN and −∞ and negative → 0, +∞ and values above GGN_PIXEL_HUGE → white, denormal → 0;
 * each kind is counted, so that a block with broken pixels can be reported and is never called converged silently. Bits
 * decide, so flush-to-zero modes change nothing. Thread-safe.
 */
#ifndef GGN_MODEL_PREPROCESS_H
#define GGN_MODEL_PREPROCESS_H

#include <stddef.h>
#include <stdint.h>

#define GGN_PIXEL_HUGE 1e20f

struct ggn_pixel_counts {
    long nan, infinite, negative, huge, denormal; /* channel values, not pixels */
};

/* One block of linear RGB; strides in elements, may be negative. */
struct ggn_linear_view {
    const float *data; /* channel 0 of pixel (0,0) */
    ptrdiff_t channel, pixel, row;
    int h, w;
    float exposure; /* factor on the linear values */
};

/* out: 3 planes of h × w bytes. *counts (may be NULL) is added to. */
void ggn_preprocess(const struct ggn_linear_view *view, uint8_t *out, struct ggn_pixel_counts *counts);

/* Values that were not finite or absurdly large: a decision on such a block deserves a warning. */
long ggn_pixel_counts_bad(const struct ggn_pixel_counts *counts);

#endif
