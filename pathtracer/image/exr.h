/*
 * Writes one scan-line OpenEXR file with any number of named float channels ("R", "lull.spp.V"), ZIP-compressed, row by row,
 * so that no second copy of the image is needed. The file appears under its name only when it is complete.
 */
#ifndef PT_IMAGE_EXR_H
#define PT_IMAGE_EXR_H

#include "base/err.h"

struct pt_exr_attribute {
    const char *name;
    const char *text; /* a string attribute, or NULL for a number */
    double number;
};

struct pt_exr_image {
    int width, height;           /* display window: the whole picture */
    int x0, y0, x1, y1;          /* data window: what is stored, end exclusive */
    int channel_count;           /* 1 … 64 */
    const char *const *channels; /* unique names */
    int attribute_count;
    const struct pt_exr_attribute *attributes;
    /* Fills row y: rows[c][x - x0] for every channel. */
    void (*row)(void *data, int y, float *const *rows);
    void *data;
};

int pt_exr_write(const char *path, const struct pt_exr_image *image, struct base_err *err);

/* Whether there is a scan-line file that has all of its pixels: not empty, not cut short. */
int pt_exr_is_whole(const char *path);

#endif
