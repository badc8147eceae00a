#include "report/sheet.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "picture/apng.h"
#include "picture/colour_map.h"
#include "picture/font.h"
#include "picture/read.h"
#include "report/shown_as.h"

enum { LEAST_SIDE = 240, GAP = 4, MARGIN = 6, BAR = 10, LEGEND = MARGIN + BAR + MARGIN + 2 * PIC_FONT_HEIGHT + MARGIN };

struct sheet {
    int32_t width, height; /* of a frame */
    int32_t enlarge;
    double low, high; /* samples, of all frames */
    struct pic_canvas canvas;
    struct pic_apng out;
};

static double scale_of(const struct sheet *s, double spp)
{
    return s->high > s->low ? log(fmax(spp, s->low) / s->low) / log(s->high / s->low) : 0.5;
}

/* What all frames must have alike, and the ends of the scale. */
static int measure(struct sheet *s, const char *path, struct base_err *err)
{
    struct pic_image spp = {0};
    int rc = pic_read_channel(path, "lull.spp.V", &spp, err);
    if (rc)
        return rc;
    if (!spp.f32 || (s->width > 0 && (spp.width != s->width || spp.height != s->height)))
        rc = base_fail(err, BASE_EINVAL, "%s: %dx%d pixels; the frames before have %dx%d", path, spp.width, spp.height,
                       s->width, s->height);
    s->width = spp.width;
    s->height = spp.height;
    for (size_t i = 0; !rc && i < (size_t)spp.width * (size_t)spp.height; i++) {
        const double v = fmax(1.0, (double)spp.f32[i]);
        s->low = fmin(s->low, v);
        s->high = fmax(s->high, v);
    }
    pic_release(&spp);
    return rc;
}

static uint8_t *pixel(const struct sheet *s, int32_t x, int32_t y)
{
    return s->canvas.rgb + 3 * ((size_t)y * (size_t)s->canvas.width + (size_t)x);
}

static void paint_scale(const struct sheet *s)
{
    static const uint8_t ink[3] = {0, 0, 0};
    const int32_t left = s->width * s->enlarge + GAP, top = s->height * s->enlarge + MARGIN, right = s->canvas.width;
    char low[32], high[32];
    for (int32_t x = left; x < right; x++)
        for (int32_t y = top; y < top + BAR; y++)
            pic_colour(PIC_VIRIDIS, s->high > s->low ? (double)(x - left) / (double)(right - left - 1) : 0.5,
                       pixel(s, x, y));
    snprintf(low, sizeof low, "%.0f spp", s->low);
    snprintf(high, sizeof high, "%.0f", s->high);
    pic_draw_text(&s->canvas, left, top + BAR + MARGIN, 2, ink, low);
    pic_draw_text(&s->canvas, right - 2 * PIC_FONT_WIDTH * (int)strlen(high), top + BAR + MARGIN, 2, ink, high);
}

static int add_frame(struct sheet *s, const char *path, struct base_err *err)
{
    struct pic_image picture = {0}, spp = {0};
    static struct report_view view;
    int rc = report_view_read(path, &view, err);
    if (!rc)
        rc = report_view_picture(path, &view, &picture, err);
    if (!rc)
        rc = pic_read_channel(path, "lull.spp.V", &spp, err);
    if (!rc &&
        (picture.width != s->width || picture.height != s->height || spp.width != s->width || spp.height != s->height))
        rc = base_fail(err, BASE_EINVAL, "%s: its layers have several sizes, or it has changed", path);
    const int32_t across = s->width * s->enlarge, down = s->height * s->enlarge;
    for (int32_t y = 0; y < down && !rc; y++)
        for (int32_t x = 0; x < across; x++) {
            const size_t i = (size_t)(y / s->enlarge) * (size_t)s->width + (size_t)(x / s->enlarge);
            memcpy(pixel(s, x, y), picture.u8 + 3 * i, 3);
            pic_colour(PIC_VIRIDIS, scale_of(s, (double)spp.f32[i]), pixel(s, across + GAP + x, y));
        }
    if (!rc)
        rc = pic_apng_add(&s->out, s->canvas.rgb, err);
    pic_release(&picture);
    pic_release(&spp);
    return rc;
}

int report_sheet(const char *const *pictures, int count, double fps, const char *path, struct base_err *err)
{
    struct sheet s = {.low = (double)INFINITY};
    int rc = 0;
    for (int i = 0; i < count && !rc; i++)
        rc = measure(&s, pictures[i], err);
    if (rc)
        return rc;
    s.enlarge = s.width < LEAST_SIDE ? (LEAST_SIDE + s.width - 1) / s.width : 1;
    s.canvas.width = 2 * s.width * s.enlarge + GAP;
    s.canvas.height = s.height * s.enlarge + LEGEND;
    const size_t bytes = 3 * (size_t)s.canvas.width * (size_t)s.canvas.height;
    s.canvas.rgb = malloc(bytes);
    if (!s.canvas.rgb)
        return base_fail_nomem(err, "sheet");
    memset(s.canvas.rgb, 255, bytes);
    paint_scale(&s);
    rc = pic_apng_begin(&s.out, path, s.canvas.width, s.canvas.height, (uint32_t)count, fps, err);
    for (int i = 0; i < count && !rc; i++)
        rc = add_frame(&s, pictures[i], err);
    if (!rc)
        rc = pic_apng_end(&s.out, err);
    pic_apng_abort(&s.out);
    free(s.canvas.rgb);
    return rc;
}
