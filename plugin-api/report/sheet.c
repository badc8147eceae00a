#include "report/report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/bytes.h"
#include "base/files.h"
#include "picture/draw.h"
#include "picture/png.h"
#include "picture/read.h"

enum { LEAST_SIDE = 240, GAP = 4, MARGIN = 6, BAR = 10, LEGEND = MARGIN + BAR + MARGIN + 2 * PIC_FONT_HEIGHT + MARGIN };

struct sheet {
    int32_t width, height; /* of a frame */
    int32_t enlarge;
    double low, high; /* samples, of all frames */
    struct pic_canvas canvas;
    struct base_file_out file;
    uint32_t frames, frame, chunks; /* all, written; numbered chunks so far */
    uint16_t delay[2];              /* of a frame, in seconds: what is divided, by what */
};

/* A moving picture as an animated PNG.
 * Browsers show it and play it in a loop; other programs show its first frame. Frames are compressed by libpng; what is
 * around them follows "Portable Network Graphics (PNG) Specification (Third Edition)", W3C 2025, 11.3.6. */

enum { SIGNATURE = 8, AROUND = 12, WORD = 4 }; /* bytes: of a file's head, of a chunk's length, name and checksum */

static void put_word(uint8_t *at, uint32_t v) { base_put_u32(at, __builtin_bswap32(v)); }

/* Failures are found by base_file_commit. */
static void write_chunk(FILE *f, const char *name, const void *data, uint32_t size)
{
    uint8_t word[WORD];
    put_word(word, size);
    fwrite(word, 1, WORD, f);
    fwrite(name, 1, WORD, f);
    fwrite(data, 1, size, f);
    put_word(word, (uint32_t)crc32(crc32(0, (const Bytef *)name, WORD), data, size));
    fwrite(word, 1, WORD, f);
}

/* Width, height and time of the frame that follows, which replaces the one before. */
static void write_frame_head(struct sheet *s)
{
    uint8_t c[26] = {0};
    put_word(c, s->chunks++);
    put_word(c + 4, (uint32_t)s->canvas.width);
    put_word(c + 8, (uint32_t)s->canvas.height);
    for (int i = 0; i < 4; i++)
        c[20 + i] = (uint8_t)(s->delay[i / 2] >> (i % 2 ? 0 : 8));
    write_chunk(s->file.file, "fcTL", c, sizeof c);
}

/* One chunk of a frame's own PNG. The first frame's all stay; of the others the compressed pixels do, under another name. */
static void take_chunk(struct sheet *s, uint8_t *chunk, uint32_t size, int *is_open)
{
    FILE *f = s->file.file;
    const char *name = (const char *)chunk + WORD;
    const int is_pixels = memcmp(name, "IDAT", WORD) == 0, is_end = memcmp(name, "IEND", WORD) == 0;
    if (is_pixels && !*is_open) {
        if (s->frame == 0) {
            uint8_t c[8] = {0}; /* how many; how often: 0, for ever */
            put_word(c, s->frames);
            write_chunk(f, "acTL", c, sizeof c);
        }
        write_frame_head(s);
        *is_open = 1;
    }
    if (is_pixels && s->frame > 0) {
        put_word(chunk + WORD, s->chunks++); /* in front of the pixels, where the name was */
        write_chunk(f, "fdAT", chunk + WORD, WORD + size);
    } else if (s->frame == 0 && !is_end) {
        fwrite(chunk, 1, AROUND + size, f);
    }
}

/* The canvas. */
static int write_frame(struct sheet *s, struct base_err *err)
{
    uint8_t *png;
    size_t size;
    int is_open = 0, rc = pic_png_bytes(s->canvas.width, s->canvas.height, s->canvas.rgb, &png, &size, err);
    if (rc)
        return rc;
    if (s->frame == 0)
        fwrite(png, 1, SIGNATURE, s->file.file);
    for (size_t at = SIGNATURE; at + AROUND <= size;) {
        const uint32_t length = __builtin_bswap32(base_get_u32(png + at));
        take_chunk(s, png + at, length, &is_open);
        at += AROUND + length;
    }
    s->frame++;
    free(png);
    return 0;
}

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

static void paint_scale(const struct sheet *s)
{
    static const uint8_t ink[3] = {0, 0, 0};
    const int32_t left = s->width * s->enlarge + GAP, top = s->height * s->enlarge + MARGIN, right = s->canvas.width;
    char low[32], high[32];
    for (int32_t x = left; x < right; x++)
        for (int32_t y = top; y < top + BAR; y++)
            pic_colour(PIC_VIRIDIS, s->high > s->low ? (double)(x - left) / (double)(right - left - 1) : 0.5,
                       pic_pixel(&s->canvas, x, y));
    snprintf(low, sizeof low, "%.0f spp", s->low);
    snprintf(high, sizeof high, "%.0f", s->high);
    pic_draw_text(&s->canvas, left, top + BAR + MARGIN, 2, ink, low);
    pic_draw_text(&s->canvas, right - 2 * PIC_FONT_WIDTH * (int)strlen(high), top + BAR + MARGIN, 2, ink, high);
}

static int add_frame(struct sheet *s, const char *path, struct base_err *err)
{
    struct pic_image picture = {0}, spp = {0};
    static struct report_view view;
    int rc = report_view_picture(path, &view, &picture, err);
    if (!rc)
        rc = pic_read_channel(path, "lull.spp.V", &spp, err);
    if (!rc &&
        (picture.width != s->width || picture.height != s->height || spp.width != s->width || spp.height != s->height))
        rc = base_fail(err, BASE_EINVAL, "%s: its layers have several sizes, or it has changed", path);
    const int32_t across = s->width * s->enlarge, down = s->height * s->enlarge;
    for (int32_t y = 0; y < down && !rc; y++)
        for (int32_t x = 0; x < across; x++) {
            const size_t i = (size_t)(y / s->enlarge) * (size_t)s->width + (size_t)(x / s->enlarge);
            memcpy(pic_pixel(&s->canvas, x, y), picture.u8 + 3 * i, 3);
            pic_colour(PIC_VIRIDIS, scale_of(s, (double)spp.f32[i]), pic_pixel(&s->canvas, across + GAP + x, y));
        }
    if (!rc)
        rc = write_frame(s, err);
    pic_release(&picture);
    pic_release(&spp);
    return rc;
}

int report_sheet(const char *const *pictures, int count, double fps, const char *path, struct base_err *err)
{
    const uint16_t parts = fps <= 60.0 ? 1000 : 250; /* as fine as 16 bits have room for */
    struct sheet s = {.low = (double)INFINITY, .frames = (uint32_t)count, .delay = {parts, (uint16_t)lround(parts * fps)}};
    int rc = 0;
    /* Twice through all frames: their scale must be known before the first is painted. */
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
    rc = base_file_begin(&s.file, path, err);
    for (int i = 0; i < count && !rc; i++)
        rc = add_frame(&s, pictures[i], err);
    if (!rc) {
        write_chunk(s.file.file, "IEND", "", 0);
        rc = base_file_commit(&s.file, err);
    }
    base_file_abort(&s.file);
    free(s.canvas.rgb);
    return rc;
}
