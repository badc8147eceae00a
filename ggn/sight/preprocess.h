/*
 * From linear radiance to what the networks see: the one conversion that data, training and inference share.
 *
 * Linear value, times exposure, cleaned, transfer curve, rounded to 8 bits. Network inputs are these codes divided by 255.
 * Cleaning: NaN and −∞ and negative → 0, +∞ and values above GGN_PIXEL_HUGE → white, denormal as a float → 0. What is
 * broken is counted, so that a block with such pixels can be reported and is never called converged silently. Flush-to-zero
 * modes change nothing. Thread-safe.
 */
#ifndef GGN_MODEL_PREPROCESS_H
#define GGN_MODEL_PREPROCESS_H

#include <stdint.h>

#define GGN_PIXEL_HUGE 1e20f

enum ggn_transfer { GGN_TRANSFER_SRGB /* IEC 61966-2-1 */, GGN_TRANSFER_GAMMA /* in^(1 / gamma) */, GGN_TRANSFER_LINEAR };

/* How linear radiance becomes what is seen. */
struct ggn_display {
    enum ggn_transfer transfer;
    double gamma, exposure; /* > 0; gamma is for GGN_TRANSFER_GAMMA */
};

/* The code of one channel value. display: NULL is sRGB at exposure 1. *bad (may be NULL) counts values that are not finite
 * or absurdly large: a decision on such a block deserves a warning. */
uint8_t ggn_preprocess(double linear, const struct ggn_display *display, long *bad);

#endif
