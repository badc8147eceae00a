/*
 * Writing PNG pictures (ISO/IEC 15948), so that a program need not load an image library to leave one behind. Thread-safe.
 */
#ifndef PICTURE_PNG_H
#define PICTURE_PNG_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

/* Writes sRGB-encoded 8-bit pixels, top row first, `channels` (1 grey, 2 grey and alpha, 3 RGB, 4 RGBA, alpha never
 * premultiplied) interleaved, to a temporary beside `path` and renames it. BASE_EINVAL for no pixels or other channels,
 * BASE_EIO, BASE_ENOMEM. */
int pic_write_png(const char *path, int32_t width, int32_t height, int channels, const uint8_t *pixels,
                  struct base_err *err);
/* The bytes of such a picture of RGB; the caller frees *bytes. width and height > 0. BASE_EINVAL, BASE_ENOMEM. */
int pic_png_bytes(int32_t width, int32_t height, const uint8_t *rgb, uint8_t **bytes, size_t *size, struct base_err *err);

#endif
