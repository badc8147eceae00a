#include "picture/draw.h"

#include <math.h>
#include <string.h>

/* Seven rows per glyph, five bits each, leftmost pixel in bit 4. */
static const struct glyph {
    char c;
    uint8_t rows[PIC_FONT_HEIGHT];
} glyphs[] = {
    {'0', {0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e}}, {'1', {0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e}},
    {'2', {0x0e, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1f}}, {'3', {0x1f, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0e}},
    {'4', {0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02}}, {'5', {0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e}},
    {'6', {0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e}}, {'7', {0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
    {'8', {0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e}}, {'9', {0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c}},
    {'s', {0x00, 0x00, 0x0e, 0x10, 0x0e, 0x01, 0x1e}}, {'p', {0x00, 0x00, 0x1e, 0x11, 0x1e, 0x10, 0x10}},
    {'k', {0x10, 0x10, 0x12, 0x14, 0x18, 0x14, 0x12}}, {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0c, 0x0c}},
    {'-', {0x00, 0x00, 0x00, 0x1f, 0x00, 0x00, 0x00}}, {'a', {0x00, 0x00, 0x0e, 0x01, 0x0f, 0x11, 0x0f}},
    {'e', {0x00, 0x00, 0x0e, 0x11, 0x1f, 0x10, 0x0e}}, {'m', {0x00, 0x00, 0x1a, 0x15, 0x15, 0x15, 0x15}},
    {'l', {0x0c, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0e}}, {'r', {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10}},
    {'i', {0x04, 0x00, 0x0c, 0x04, 0x04, 0x04, 0x0e}}, {'x', {0x00, 0x00, 0x11, 0x0a, 0x04, 0x0a, 0x11}},
    {'n', {0x00, 0x00, 0x16, 0x19, 0x11, 0x11, 0x11}},
};

static const uint8_t *find(char c)
{
    for (size_t i = 0; i < sizeof glyphs / sizeof glyphs[0]; i++)
        if (glyphs[i].c == c)
            return glyphs[i].rows;
    return NULL;
}

static void fill(const struct pic_canvas *canvas, int x, int y, int size, const uint8_t rgb[3])
{
    for (int v = y < 0 ? 0 : y; v < y + size && v < canvas->height; v++)
        for (int u = x < 0 ? 0 : x; u < x + size && u < canvas->width; u++)
            memcpy(pic_pixel(canvas, u, v), rgb, 3);
}

void pic_draw_text(const struct pic_canvas *canvas, int x, int y, int scale, const uint8_t rgb[3], const char *text)
{
    for (; *text != '\0'; text++, x += PIC_FONT_WIDTH * scale) {
        const uint8_t *rows = find(*text);
        if (!rows)
            continue;
        for (int row = 0; row < PIC_FONT_HEIGHT; row++)
            for (int column = 0; column < PIC_FONT_WIDTH - 1; column++)
                if (rows[row] >> (4 - column) & 1)
                    fill(canvas, x + column * scale, y + row * scale, scale, rgb);
    }
}

enum { VIRIDIS_STEPS = 16, MAGMA_STEPS = 8 };

static const uint8_t viridis[VIRIDIS_STEPS + 1][3] = {
    {68, 1, 84},    {72, 21, 104},  {72, 40, 120},  {69, 58, 130},  {62, 74, 137},  {55, 91, 141},
    {48, 106, 142}, {42, 121, 142}, {33, 145, 140}, {31, 154, 138}, {34, 168, 132}, {53, 183, 121},
    {83, 197, 104}, {122, 209, 81}, {165, 219, 54}, {210, 226, 27}, {253, 231, 37},
};
static const uint8_t magma[MAGMA_STEPS + 1][3] = {
    {0, 0, 4},      {29, 17, 71},   {81, 18, 124},   {130, 38, 129},  {182, 54, 121},
    {230, 81, 100}, {251, 136, 97}, {254, 194, 135}, {252, 253, 191},
};
static const struct {
    int steps;
    const uint8_t (*knots)[3];
} maps[] = {[PIC_VIRIDIS] = {VIRIDIS_STEPS, viridis}, [PIC_MAGMA] = {MAGMA_STEPS, magma}};

void pic_colour(enum pic_colour_map map, double t, uint8_t rgb[3])
{
    const int steps = maps[map].steps;
    const double x = t > 0.0 ? steps * fmin(t, 1.0) : 0.0;
    const int i = x < steps - 1 ? (int)x : steps - 1;
    const uint8_t *low = maps[map].knots[i], *high = maps[map].knots[i + 1];
    for (int c = 0; c < 3; c++)
        rgb[c] = (uint8_t)lround((1.0 - (x - i)) * low[c] + (x - i) * high[c]);
}
