/*
 * The pixel codings of ggn/data/FORMAT.md, one plane at a time. Pure functions, thread-safe.
 *
 * Planes are planar: channel after channel, each `width`x`height`, rows top to bottom.
 */
#ifndef GGN_DATA_PLANES_H
#define GGN_DATA_PLANES_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum ggn_plane { /* plane numbers of the file format */
    GGN_PLANE_DISPLAY = 1,
    GGN_PLANE_FINE = 2,
    GGN_PLANE_HALF_LOG = 3,
    GGN_PLANE_MEAN_F16 = 4,
    GGN_PLANE_HALF_F16 = 5
};
enum { GGN_FILTER_SHUFFLE = 1, GGN_FILTER_AVERAGE = 2, GGN_FILTER_GREEN = 4 };

/* Bytes of a plane before compression; 0 for planes that this version does not know. */
size_t ggn_plane_raw_bytes(uint32_t plane, uint32_t width, uint32_t height);
/* Which filters may be on a plane. */
uint32_t ggn_plane_filters(uint32_t plane);

/* Undo or apply a filter set in place. data: the plane's raw bytes. BASE_ENOMEM only. */
int ggn_plane_unfilter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, struct base_err *err);
int ggn_plane_filter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, struct base_err *err);

float ggn_half_to_float(uint16_t half);
/* Round to nearest even; finite values are clamped to +-65504, NaN becomes 0. */
uint16_t ggn_half_from_float(float value);

/* FINE: refines display code d to the linear value x. */
uint8_t ggn_fine_encode(uint8_t display, double x);
double ggn_fine_decode(uint8_t display, uint8_t fine);
/* HALF_LOG: signed logarithmic code of a difference. */
uint8_t ggn_halflog_encode(double value);
double ggn_halflog_decode(uint8_t code);

#endif
