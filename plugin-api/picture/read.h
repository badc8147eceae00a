/*
 * Image files in: the only door to OpenImageIO, which lies in a shared object of its own (picture/oiio.h). Whatever it reads
 * is accepted: EXR, HDR, PFM, PNG, JPEG, TGA, TIFF …
 *
 * All functions fail
 * - with BASE_EIO when the file cannot be opened, or lib/lull/modules/lull-images.so cannot be loaded;
 * - with BASE_EINVAL when the file is no image, is damaged, or has more pixels than an image may have;
 * - with BASE_ENOMEM.
 * Then *out stays as it was. Thread-safe on distinct images.
 */
#ifndef PICTURE_READ_H
#define PICTURE_READ_H

#include "base/err.h"
#include "picture/image.h"

/* The picture, as picture/channels.h finds it: grey, or red, green and blue, each with alpha if its pixels have one; codes
 * of an 8-bit file, else values, those of the file whatever its primaries. Where the stored pixels are not those of the
 * picture (EXR's data and display window) they are put into their place: what is missing is black, what lies outside is
 * left out, and is_part is set. */
int pic_read(const char *path, struct pic_image *out, struct base_err *err);
/* The same from memory; `name` only tells the format by its extension and names the image in errors. Formats that
 * OpenImageIO reads from files alone are refused (BASE_EINVAL). */
int pic_read_memory(const char *name, const void *data, size_t size, struct pic_image *out, struct base_err *err);
/* The sRGB codes that a display shows of the stored pixels, three channels, found in the same way. Those of integers
 * come as they are, those of light are made by pic_to_rec709 and pic_encode. Grey is repeated, alpha
 * dropped. */
int pic_read_display(const char *path, struct pic_image *out, struct base_err *err);
/* The same, and the light itself beside the codes where the file holds light. */
int pic_read_light(const char *path, struct pic_image *out, struct base_err *err);
/* The values of one channel, found by name ("lull.spp.V") in any part of the file. BASE_EINVAL if there is none. */
int pic_read_channel(const char *path, const char *channel, struct pic_image *out, struct base_err *err);
/* The light of a layer, as pic_choose_layer finds it and pic_read_light has that of the picture; f32 alone. BASE_EINVAL if
 * the file does not have it. */
int pic_read_layer(const char *path, const char *layer, struct pic_image *out, struct base_err *err);
/* Of the first part, without its pixels: where they lie, and the attributes whose names are set. */
int pic_read_header(const char *path, struct pic_window *window, struct pic_attribute *attributes, int count,
                    struct base_err *err);

/* m: linear light of the primaries and the white that a file names, as CIE 1931 x, y, to that of Rec. 709, by way of XYZ,
 * without chromatic adaptation. 0 when they span no colour space: numbers that are not finite, primaries on a line, a white
 * outside of them. */
int pic_primaries_to_rec709(const float primaries[8], double m[3][3]);
/* Makes light of other primaries (image->has_primaries) light of Rec. 709; else it does nothing. It is the same light: a
 * white that differs is no white any more (no chromatic adaptation, as OpenEXR, tev and Mitsuba). Colours outside of
 * Rec. 709 get negative values. BASE_EINVAL when the file's primaries and white span no colour space. */
int pic_to_rec709(const char *name, struct pic_image *image, struct base_err *err);
/* Gives an RGB image of linear light (f32, Rec. 709 primaries) its codes too. `name` names it in errors. */
int pic_encode(const char *name, struct pic_image *image, struct base_err *err);

/* Frees the pixels and zeroes *image. */
void pic_release(struct pic_image *image);

#endif
