/*
 * Image files through OpenImageIO: textures and masks in. The C face of the one C++ file of the path tracer, which lies in a
 * shared object of its own: OpenImageIO links with hundreds of libraries and would be most of the start of a scene without
 * pictures, so it is loaded by the first read.
 *
 * Pixels are row-major, top row first, channels interleaved, alpha as stored (never premultiplied here). Thread-safe.
 */
#ifndef PT_IMAGE_OIIO_H
#define PT_IMAGE_OIIO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "base/err.h"

struct pt_oiio_image {
    int32_t width, height, channels; /* channels in [1, 4] */
    int32_t is_float_file;           /* the file holds half or float: linear light unless the user says otherwise */
    uint8_t *u8;                     /* owns: 8-bit files; else NULL */
    float *f32;                      /* owns: every other file, integers scaled to [0, 1]; else NULL */
};

/* Reads the first sub-image of `path`. EXR, HDR, PFM, PNG, JPEG, TGA, TIFF … whatever OpenImageIO reads; more than four
 * channels are cut to the first four. BASE_EIO when it cannot be opened, BASE_EINVAL when it is no image, damaged, or larger
 * than 2^28 pixels; BASE_EIO also when the shared object cannot be loaded. On success the caller releases *out. */
int pt_oiio_read(const char *path, struct pt_oiio_image *out, struct base_err *err);

/* The same from memory; `name` only tells the format by its extension and names the image in errors. Formats that
 * OpenImageIO reads from files alone are refused (BASE_EINVAL). */
int pt_oiio_read_memory(const char *name, const void *data, size_t size, struct pt_oiio_image *out, struct base_err *err);

/* Frees the pixels and zeroes *image. */
void pt_oiio_release(struct pt_oiio_image *image);

/* What the shared object holds. The program has its address from there; whoever links with it has it at once. */
struct pt_oiio_library {
    int (*read)(const char *path, struct pt_oiio_image *out, struct base_err *err);
    int (*read_memory)(const char *name, const void *data, size_t size, struct pt_oiio_image *out, struct base_err *err);
};
extern const struct pt_oiio_library pt_oiio_library __attribute__((weak, visibility("default")));

#ifdef __cplusplus
}
#endif

#endif
