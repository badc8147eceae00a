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
    SEQ_PLANE_HALF_F16 = 5
};
enum { SEQ_FILTER_SHUFFLE = 1, SEQ_FILTER_AVERAGE = 2, SEQ_FILTER_GREEN = 4 };

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
