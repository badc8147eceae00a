/* Colour maps that are perceptually uniform (van der Walt and Smith, 2015), for pictures of numbers. Thread-safe. */
#ifndef PICTURE_COLOUR_MAP_H
#define PICTURE_COLOUR_MAP_H

#include <stdint.h>

enum pic_colour_map { PIC_VIRIDIS, PIC_MAGMA };

/* t in [0, 1] (clamped, NaN is 0). Linear between the steps of a table. */
void pic_colour(enum pic_colour_map map, double t, uint8_t rgb[3]);

#endif
