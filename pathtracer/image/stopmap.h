/*
 * A number per block as a picture, the stop map above all: each block in the colour of its number (viridis over a
 * logarithmic scale), the number written into it, and a legend below.
 */
#ifndef PT_IMAGE_STOPMAP_H
#define PT_IMAGE_STOPMAP_H

#include <stdint.h>

#include "base/err.h"

struct pt_stopmap_block {
    int x0, y0, x1, y1; /* end exclusive */
    double value; /* >= 0 */
};

struct pt_stopmap {
    int width, height; /* pixels of the picture */
    uint8_t *rgb;      /* owns; [height, width, 3] */
};

/* unit: of the values, for the legend. Integers and what is above 99 are written whole, others with two digits.
 * Paints blocks of the area [x0, x1) x [y0, y1); small blocks are enlarged until their numbers fit. */
int pt_stopmap_draw(int x0, int y0, int x1, int y1, const struct pt_stopmap_block *blocks, uint32_t count,
                    const char *unit, struct pt_stopmap *out, struct base_err *err);
void pt_stopmap_release(struct pt_stopmap *map);

/* Colour of t in [0, 1] (clamped), dark blue to yellow, perceptually uniform. */
void pt_viridis(double t, uint8_t rgb[3]);

#endif
