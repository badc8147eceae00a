/* An image in memory. Pixels are row-major, top row first, channels interleaved, alpha as stored (never premultiplied). */
#ifndef PICTURE_IMAGE_H
#define PICTURE_IMAGE_H

#include <stddef.h>
#include <stdint.h>

enum { PIC_MAX_SIDE = 32768, PIC_MAX_PIXELS = 1 << 27 };

/* Red, green, blue, white of Rec. 709. */
#define PIC_REC709_PRIMARIES \
    { \
        0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f \
    }

struct pic_image {
    int32_t width, height, channels; /* channels in [1, 4] */
    int32_t is_float_file;           /* the file holds half or float: linear light unless the user says otherwise */
    uint8_t *u8;                     /* owns [height][width][channels]: codes; or NULL */
    float *f32;                      /* owns [height][width][channels]: values, those of integers in [0, 1]; or NULL */
    size_t clipped;                  /* pixels that were NaN, infinite or negative when pic_encode made codes of them */
    int32_t is_part;                 /* pic_read: the file has other pixels than its picture */
    int32_t has_primaries;           /* the file's colours are not those of Rec. 709: pic_to_rec709 makes them so */
    float primaries[8];              /* x, y of red, green, blue and white, if has_primaries */
};

/* Where the stored pixels lie in the whole picture: 0 <= x0 < x1 <= width, the same of y. */
struct pic_window {
    int32_t width, height, x0, y0, x1, y1;
};

struct pic_attribute {
    const char *name; /* borrowed */
    char text[4096];  /* cut to fit; of numbers their digits; "": the file has no such attribute */
};

#endif
