/*
 * The pixel codings of FORMAT.md, one plane at a time. Pure functions, thread-safe.
 *
 * Planes are planar: channel after channel, each `width`x`height`, rows top to bottom.
 */
#ifndef SEQUENCE_PLANES_H
#define SEQUENCE_PLANES_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum seq_plane_number {
    SEQ_PLANE_DISPLAY = 1,
    SEQ_PLANE_FINE = 2,
    SEQ_PLANE_HALF_LOG = 3,
    SEQ_PLANE_MEAN_F16 = 4,
    SEQ_PLANE_HALF_F16 = 5,
    /* Of looks: estimates as floats of 32 bits, 16 + the plane's index in the ABI (LULL_PLANE_). */
    SEQ_PLANE_COLOR = 16,
    SEQ_PLANE_WEIGHT = 17,
    SEQ_PLANE_SPP = 18,
    SEQ_PLANE_MOMENT2 = 19, /* less the square of the luminance of COLOR */
    SEQ_PLANE_HALF = 20,
    SEQ_PLANE_ALBEDO = 21,
    SEQ_PLANE_NORMAL = 22,
    SEQ_PLANE_DEPTH = 23,
    SEQ_PLANE_DROPPED = 24, /* samples that are missing in COLOR and MOMENT2; in HALF */
    SEQ_PLANE_DROPPED_HALF = 25,
    SEQ_PLANE_REST = 26,     /* what is in COLOR and not in HALF, in the place of COLOR */
    SEQ_PLANE_DENOISED = 27, /* of COLOR; of HALF; of REST */
    SEQ_PLANE_DENOISED_HALF = 28,
    SEQ_PLANE_DENOISED_REST = 29,
    SEQ_PLANES_END = 30
};
enum { SEQ_FILTER_SHUFFLE = 1, SEQ_FILTER_AVERAGE = 2, SEQ_FILTER_GREEN = 4 };

/* Is it one of looks, and how many floats does it have for a pixel? 0: it is none. */
uint32_t seq_plane_channels(uint32_t plane);
/* Bytes of a plane before compression; 0 for planes that this version does not know. */
size_t seq_plane_raw_bytes(uint32_t plane, uint32_t width, uint32_t height);
/* Which filters may be on a plane. */
uint32_t seq_plane_filters(uint32_t plane);

/* Applies a filter set in place, or undoes it. data: the plane's raw bytes. BASE_ENOMEM only. */
int seq_plane_filter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, int undo,
                     struct base_err *err);

/* The half float of a pixel: nearest even, clamped to +-65504; NaN becomes 0. */
uint16_t seq_half_float(double value);

/* FINE: refines the display code of the linear value x. */
uint8_t seq_fine_encode(uint8_t display, double x);
double seq_fine_decode(uint8_t display, uint8_t fine);
/* HALF_LOG: signed logarithmic code of a difference. */
uint8_t seq_half_log_encode(double value);
double seq_half_log_decode(uint8_t code);

#endif
