#include "image/stopmap.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "image/font.h"

enum { LEGEND_HEIGHT = 44, MIN_BLOCK_PX = 48, MAX_ENLARGE = 16, MIN_WIDTH = 160 };

void pt_viridis(double t, uint8_t rgb[3])
{
    /* Smith and van der Walt's viridis (2015), at 17 even steps; linear in between is closer than an eye can tell. */
    static const uint8_t stops[17][3] = {
        {68, 1, 84},    {72, 21, 104},  {72, 40, 120},  {69, 58, 130},  {62, 74, 137},  {55, 91, 141},
        {48, 106, 142}, {42, 121, 142}, {33, 145, 140}, {31, 154, 138}, {34, 168, 132}, {53, 183, 121},
        {83, 197, 104}, {122, 209, 81}, {165, 219, 54}, {210, 226, 27}, {253, 231, 37},
    };
    t = t > 0.0 ? fmin(t, 1.0) : 0.0;
    int i = (int)(t * 16.0);
    if (i > 15)
        i = 15;
    double f = t * 16.0 - i;
    for (int c = 0; c < 3; c++)
        rgb[c] = (uint8_t)lround((1.0 - f) * stops[i][c] + f * stops[i + 1][c]);
}

/* Nothing has no place on a logarithmic scale. */
static double positive(double value)
{
    return value > 0.0 ? value : 1.0;
}

static double scale_of(double value, double low, double high)
{
    return high > low ? log(value / low) / log(high / low) : 0.5;
}

static int format(double value, char text[24])
{
    return snprintf(text, 24, value > 99.0 || value == floor(value) ? "%.0f" : "%.2g", value);
}

/* Black on light colours, white on dark ones. */
static const uint8_t *ink(const uint8_t rgb[3])
{
    static const uint8_t black[3] = {0, 0, 0}, white[3] = {255, 255, 255};
    return 2 * rgb[0] + 5 * rgb[1] + rgb[2] > 8 * 120 ? black : white;
}

static void put(const struct pt_canvas *c, int x, int y, const uint8_t rgb[3])
{
    memcpy(c->rgb + 3 * ((size_t)y * (size_t)c->width + (size_t)x), rgb, 3);
}

/* digits: of the longest number, so that all are written in the same size. */
static void paint_block(const struct pt_canvas *canvas, int x0, int y0, int x1, int y1, double value, double t, int digits)
{
    uint8_t colour[3], edge[3];
    pt_viridis(t, colour);
    for (int c = 0; c < 3; c++)
        edge[c] = (uint8_t)(colour[c] * 3 / 4);
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
            put(canvas, x, y, x == x1 - 1 || y == y1 - 1 ? edge : colour);
    char text[24];
    int length = format(value, text);
    for (int scale = 4; scale >= 1; scale--) {
        int w = (length * PT_FONT_WIDTH - 1) * scale, h = PT_FONT_HEIGHT * scale;
        if ((digits * PT_FONT_WIDTH - 1) * scale * 5 > (x1 - x0) * 4 || h * 3 > (y1 - y0) * 2)
            continue;
        pt_font_draw(canvas, (x0 + x1 - w) / 2, (y0 + y1 - h) / 2, scale, ink(colour), text);
        break;
    }
}

static void paint_legend(const struct pt_canvas *canvas, int top, double low, double high, const char *unit)
{
    static const uint8_t paper[3] = {255, 255, 255}, black[3] = {0, 0, 0};
    int margin = 8, left = margin, right = canvas->width - margin;
    for (int y = top; y < canvas->height; y++)
        for (int x = 0; x < canvas->width; x++)
            put(canvas, x, y, paper);
    for (int x = left; x < right; x++) {
        uint8_t colour[3];
        pt_viridis(high > low ? (double)(x - left) / (double)(right - left - 1) : 0.5, colour);
        for (int y = top + 6; y < top + 20; y++)
            put(canvas, x, y, colour);
    }
    /* Ends and the middle of the logarithmic scale, as far as they fit. */
    const double at[3] = {0.0, 1.0, 0.5};
    for (int i = 0; i < (canvas->width >= 360 && high > low ? 3 : 2); i++) {
        char text[40];
        char number[24];
        double value = low * pow(high / low, at[i]);
        format(high > 99.0 ? round(value) : value, number);
        int n = snprintf(text, sizeof text, i == 0 ? "%s %s" : "%s", number, unit) * PT_FONT_WIDTH * 2;
        int x = left + (int)(at[i] * (right - left - n));
        pt_font_draw(canvas, x, top + 25, 2, black, text);
    }
}

int pt_stopmap_draw(int x0, int y0, int x1, int y1, const struct pt_stopmap_block *blocks, uint32_t count,
                    const char *unit, struct pt_stopmap *out, struct base_err *err)
{
    double low = INFINITY, high = 0.0;
    int widest = 1;
    for (uint32_t i = 0; i < count; i++) {
        low = fmin(low, positive(blocks[i].value));
        high = fmax(high, positive(blocks[i].value));
        int w = blocks[i].x1 - blocks[i].x0;
        widest = w > widest ? w : widest;
    }
    int enlarge = (MIN_BLOCK_PX + widest - 1) / widest;
    while (enlarge < MAX_ENLARGE && (x1 - x0) * enlarge < MIN_WIDTH)
        enlarge++;
    enlarge = enlarge > MAX_ENLARGE ? MAX_ENLARGE : enlarge;
    struct pt_stopmap map = {.width = (x1 - x0) * enlarge, .height = (y1 - y0) * enlarge + LEGEND_HEIGHT};
    map.rgb = calloc((size_t)map.width * (size_t)map.height, 3);
    if (!map.rgb)
        return base_fail_nomem(err, "stop map");
    int digits = 1;
    for (uint32_t i = 0; i < count; i++) {
        char text[24];
        int n = format(blocks[i].value, text);
        digits = n > digits ? n : digits;
    }
    struct pt_canvas canvas = {.width = map.width, .height = map.height, .rgb = map.rgb};
    for (uint32_t i = 0; i < count; i++) {
        const struct pt_stopmap_block *b = &blocks[i];
        paint_block(&canvas, (b->x0 - x0) * enlarge, (b->y0 - y0) * enlarge, (b->x1 - x0) * enlarge, (b->y1 - y0) * enlarge,
                    b->value, scale_of(positive(b->value), low, high), digits);
    }
    paint_legend(&canvas, (y1 - y0) * enlarge, low, high, unit);
    *out = map;
    return 0;
}

void pt_stopmap_release(struct pt_stopmap *map)
{
    free(map->rgb);
    *map = (struct pt_stopmap){0};
}
