/* What pictures of numbers are drawn with. Thread-safe. */
#ifndef PICTURE_DRAW_H
#define PICTURE_DRAW_H

#include <stddef.h>
#include <stdint.h>

struct pic_canvas {
    int width, height;
    uint8_t *rgb; /* borrows; [height, width, 3] */
};

static inline uint8_t *pic_pixel(const struct pic_canvas *canvas, int x, int y)
{
    return canvas->rgb + 3 * ((size_t)y * (size_t)canvas->width + (size_t)x);
}

/* A built-in 5x7 pixel font for the few characters that pictures of ours need: digits, "spk. -" and some letters. Characters
 * it does not have are drawn as blanks. */
enum { PIC_FONT_WIDTH = 6, PIC_FONT_HEIGHT = 7 }; /* cell: five columns and a gap */
/* Draws text with its upper left corner at (x, y), each font pixel as scale x scale; what is outside is cut off. */
void pic_draw_text(const struct pic_canvas *canvas, int x, int y, int scale, const uint8_t rgb[3], const char *text);

/* Colour maps that are perceptually uniform (van der Walt and Smith, 2015). */
enum pic_colour_map { PIC_VIRIDIS, PIC_MAGMA };
/* t in [0, 1] (clamped, NaN is 0). Linear between the steps of a table. */
void pic_colour(enum pic_colour_map map, double t, uint8_t rgb[3]);

#endif
