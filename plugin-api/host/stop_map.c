#include "host/frame.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "picture/png.h"
#include "base/text.h"

enum { VIEW_NAME = 256 }; /* bytes; no file system has longer names */
enum { LEGEND_HEIGHT = 44, MIN_BLOCK_PX = 48, MAX_ENLARGE = 16, MIN_WIDTH = 160 };

/* Nothing has no place on a logarithmic scale. */
static double positive(double value) { return value > 0.0 ? value : 1.0; }

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

/* digits: of the longest number, so that all are written in the same size. */
static void paint_block(const struct pic_canvas *canvas, int x0, int y0, int x1, int y1, double value, double t, int digits)
{
    uint8_t colour[3], edge[3];
    pic_colour(PIC_VIRIDIS, t, colour);
    for (int c = 0; c < 3; c++)
        edge[c] = (uint8_t)(colour[c] * 3 / 4);
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++)
            memcpy(pic_pixel(canvas, x, y), x == x1 - 1 || y == y1 - 1 ? edge : colour, 3);
    char text[24];
    int length = format(value, text);
    for (int scale = 4; scale >= 1; scale--) {
        int w = (length * PIC_FONT_WIDTH - 1) * scale, h = PIC_FONT_HEIGHT * scale;
        if ((digits * PIC_FONT_WIDTH - 1) * scale * 5 > (x1 - x0) * 4 || h * 3 > (y1 - y0) * 2)
            continue;
        pic_draw_text(canvas, (x0 + x1 - w) / 2, (y0 + y1 - h) / 2, scale, ink(colour), text);
        break;
    }
}

static void paint_legend(const struct pic_canvas *canvas, int top, double low, double high, const char *unit)
{
    static const uint8_t paper[3] = {255, 255, 255}, black[3] = {0, 0, 0};
    int margin = 8, left = margin, right = canvas->width - margin;
    for (int y = top; y < canvas->height; y++)
        for (int x = 0; x < canvas->width; x++)
            memcpy(pic_pixel(canvas, x, y), paper, 3);
    for (int x = left; x < right; x++) {
        uint8_t colour[3];
        pic_colour(PIC_VIRIDIS, high > low ? (double)(x - left) / (double)(right - left - 1) : 0.5, colour);
        for (int y = top + 6; y < top + 20; y++)
            memcpy(pic_pixel(canvas, x, y), colour, 3);
    }
    /* Ends and the middle of the logarithmic scale, as far as they fit. */
    const double at[3] = {0.0, 1.0, 0.5};
    for (int i = 0; i < (canvas->width >= 360 && high > low ? 3 : 2); i++) {
        char text[40];
        char number[24];
        double value = low * pow(high / low, at[i]);
        format(high > 99.0 ? round(value) : value, number);
        int n = snprintf(text, sizeof text, i == 0 ? "%s %s" : "%s", number, unit) * PIC_FONT_WIDTH * 2;
        int x = left + (int)(at[i] * (right - left - n));
        pic_draw_text(canvas, x, top + 25, 2, black, text);
    }
}

/* A picture in the making. */
struct map {
    const struct lull_host_blocks *blocks;
    const double *values;
    int enlarge, digits; /* digits: of the longest number */
    double low, high;    /* of the values */
    struct pic_canvas canvas;
};

/* Small blocks are enlarged until their numbers fit, but for a picture that would be too large to look at. */
static void measure(struct map *m)
{
    static const double most_pixels = 1 << 25;
    const struct lull_host_blocks *b = m->blocks;
    const double pixels = (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0);
    int widest = 1;
    m->low = (double)INFINITY;
    m->digits = 1;
    for (uint32_t i = 0; i < b->count; i++) {
        char text[24];
        int w = b->list[i].x1 - b->list[i].x0, n = format(m->values[i], text);
        m->low = fmin(m->low, positive(m->values[i]));
        m->high = fmax(m->high, positive(m->values[i]));
        m->digits = n > m->digits ? n : m->digits;
        widest = w > widest ? w : widest;
    }
    m->enlarge = (MIN_BLOCK_PX + widest - 1) / widest;
    while (m->enlarge < MAX_ENLARGE && (b->x1 - b->x0) * m->enlarge < MIN_WIDTH)
        m->enlarge++;
    m->enlarge = m->enlarge > MAX_ENLARGE ? MAX_ENLARGE : m->enlarge;
    while (m->enlarge > 1 && pixels * m->enlarge * m->enlarge > most_pixels)
        m->enlarge--;
    m->canvas.width = (b->x1 - b->x0) * m->enlarge;
    m->canvas.height = (b->y1 - b->y0) * m->enlarge + LEGEND_HEIGHT;
}

int32_t lull_host_paint(const struct lull_host_blocks *b, const double *values, const char *unit, struct pic_canvas *out,
                        struct lull_error *err)
{
    struct map m = {.blocks = b, .values = values};
    measure(&m);
    m.canvas.rgb = calloc((size_t)m.canvas.width * (size_t)m.canvas.height, 3);
    if (!m.canvas.rgb)
        return lull_host_no_memory(err, "stop map");
    for (uint32_t i = 0; i < b->count; i++) {
        const struct lull_host_block *k = &b->list[i];
        paint_block(&m.canvas, (k->x0 - b->x0) * m.enlarge, (k->y0 - b->y0) * m.enlarge, (k->x1 - b->x0) * m.enlarge,
                    (k->y1 - b->y0) * m.enlarge, values[i], scale_of(positive(values[i]), m.low, m.high), m.digits);
    }
    paint_legend(&m.canvas, (b->y1 - b->y0) * m.enlarge, m.low, m.high, unit);
    *out = m.canvas;
    return LULL_OK;
}

int32_t lull_host_value_map(const struct lull_host_blocks *b, const double *values, const char *unit, const char *path,
                            struct lull_error *err)
{
    struct base_err e = {0};
    struct pic_canvas map;
    int32_t code = lull_host_given(err, "blocks", b, "values", values, "unit", unit, "path", path, NULL);
    for (uint32_t i = 0; code == LULL_OK && i < b->count; i++)
        if (!(isfinite(values[i]) && values[i] >= 0.0))
            code = lull_error_set(err, LULL_E_INVALID, "values[%u] %g: expected a finite number from 0", i, values[i]);
    if (code == LULL_OK)
        code = lull_host_paint(b, values, unit, &map, err);
    if (code != LULL_OK)
        return code;
    int rc = pic_write_png(path, map.width, map.height, 3, map.rgb, &e);
    free(map.rgb);
    return rc ? lull_host_translate(&e, err) : LULL_OK;
}

static int32_t write_picture(const struct lull_host_blocks *b, const char *path, struct lull_error *err)
{
    double *spp = calloc(b->count, sizeof *spp);
    if (!spp)
        return lull_host_no_memory(err, "stop map");
    for (uint32_t i = 0; i < b->count; i++)
        spp[i] = (double)b->list[i].spp;
    int32_t code = lull_host_value_map(b, spp, "spp", path, err);
    free(spp);
    return code;
}

/* name;t0;…;t15; */
static int32_t write_table(const struct lull_host_blocks *b, const char *path, const char *scene, struct lull_error *err)
{
    struct base_err e = {0};
    struct base_file_out out;
    if (base_file_begin(&out, path, &e) != 0)
        return lull_host_translate(&e, err);
    char name[VIEW_NAME];
    base_view_name(scene, name, sizeof name);
    fprintf(out.file, "%s;", name);
    for (uint32_t i = 0; i < b->count; i++)
        fprintf(out.file, "%llu;", (unsigned long long)b->list[i].spp);
    fprintf(out.file, "\n");
    return base_file_commit(&out, &e) != 0 ? lull_host_translate(&e, err) : LULL_OK;
}

int32_t lull_host_stop_map(const struct lull_host_blocks *b, const char *path, const char *scene, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "blocks", b, "path", path, "scene", scene, NULL);
    if (code != LULL_OK)
        return code;
    return base_file_has_ending(path, "csv") ? write_table(b, path, scene, err) : write_picture(b, path, err);
}
