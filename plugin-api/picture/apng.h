/*
 * A moving picture as an animated PNG, which browsers show and play in a loop; other programs show its first frame. Frames
 * are compressed by libpng; what is around them follows "Portable Network Graphics (PNG) Specification (Third Edition)", W3C
 * 2025, 11.3.6.
 */
#ifndef PICTURE_APNG_H
#define PICTURE_APNG_H

#include <stdint.h>

#include "base/err.h"
#include "base/files.h"

struct pic_apng {
    struct base_file_out file;
    int32_t width, height;
    uint32_t frames, frame, chunks; /* announced, written; numbered chunks so far */
    uint16_t delay[2];              /* of a frame, in seconds: what is divided, by what */
};

/* frames of width x height, so many per second (1 to 240). Then `frames` times pic_apng_add, then pic_apng_end, or
 * pic_apng_abort at any time; after a failure, too. */
int pic_apng_begin(struct pic_apng *a, const char *path, int32_t width, int32_t height, uint32_t frames, double fps,
                   struct base_err *err);
/* rgb: [height][width][3], sRGB. */
int pic_apng_add(struct pic_apng *a, const uint8_t *rgb, struct base_err *err);
/* Puts the file in place. */
int pic_apng_end(struct pic_apng *a, struct base_err *err);
void pic_apng_abort(struct pic_apng *a);

#endif
