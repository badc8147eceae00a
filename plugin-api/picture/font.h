/*
 * A built-in 5x7 pixel font for the few characters that pictures of ours need: digits, "spk. -" and some letters. Characters
 * it does not have are drawn as blanks.
 */
#ifndef PICTURE_FONT_H
#define PICTURE_FONT_H

#include <stdint.h>

struct pic_canvas {
    int width, height;
    uint8_t *rgb; /* borrows; [height, width, 3] */
};

enum { PIC_FONT_WIDTH = 6, PIC_FONT_HEIGHT = 7 }; /* cell: five columns and a gap */

/* Draws text with its upper left corner at (x, y), each font pixel as scale x scale; what is outside is cut off. */
void pic_draw_text(const struct pic_canvas *canvas, int x, int y, int scale, const uint8_t rgb[3], const char *text);

#endif
