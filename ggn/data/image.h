/*
 * Images in and out of ggn: whole images in memory, RGB, rows top to bottom, no padding.
 *
 * The only door to OpenImageIO (data/oiio.h). Any format that it reads is accepted; what comes out is always three channels:
 * grey is repeated, alpha is dropped. BASE_EIO when lib/ggn-images.so cannot be loaded. Thread-safe on distinct objects.
 */
#ifndef GGN_DATA_IMAGE_H
#define GGN_DATA_IMAGE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { GGN_IMAGE_MAX_SIDE = 32768, GGN_IMAGE_MAX_PIXELS = 1 << 27 };

struct ggn_image8 { /* display image: sRGB, 8 bit; owns data [height][width][3] */
    int width, height;
    uint8_t *data;
    size_t clipped; /* pixels of a float file that were NaN, infinite or negative before they were encoded */
};

struct ggn_imagef { /* linear light, Rec. 709 primaries; owns data [height][width][channels] */
    int width, height, channels;
    float *data;
};

void ggn_image8_release(struct ggn_image8 *image);
void ggn_imagef_release(struct ggn_imagef *image);

/* Reads a display image. 8-bit files come through unchanged; float files (EXR, HDR) are clamped and sRGB-encoded. */
int ggn_image8_read(const char *path, struct ggn_image8 *image, struct base_err *err);

/* Reads one named channel ("lull.spp.V") of any part of an EXR into a one-channel image. BASE_EINVAL if there is none. */
int ggn_imagef_read_channel(const char *path, const char *channel, struct ggn_imagef *image, struct base_err *err);

/* Writes an 8-bit RGB PNG atomically. data [height][width][3]. */
int ggn_image8_write_png(const char *path, const uint8_t *data, int width, int height, struct base_err *err);

enum ggn_colormap { GGN_MAGMA, GGN_VIRIDIS };
/* v in [0,1] (clamped, NaN is 0) -> rgb. Perceptually uniform maps (van der Walt & Smith), interpolated from nine knots. */
void ggn_colormap_rgb(enum ggn_colormap map, double v, uint8_t rgb[3]);

#ifdef __cplusplus
}
#endif
#endif
