/* An image in memory. Pixels are row-major, top row first, channels interleaved, alpha as stored (never premultiplied). */
#ifndef PICTURE_IMAGE_H
#define PICTURE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

enum { PIC_MAX_SIDE = 32768, PIC_MAX_PIXELS = 1 << 27 };

struct pic_image {
    int32_t width, height, channels; /* channels in [1, 4] */
    int32_t is_float_file;           /* the file holds half or float: linear light unless the user says otherwise */
    uint8_t *u8;                     /* owns [height][width][channels]: codes; or NULL */
    float *f32;                      /* owns [height][width][channels]: values, those of integers in [0, 1]; or NULL */
    size_t clipped;                  /* pixels that were NaN, infinite or negative when pic_encode made codes of them */
};

#endif
