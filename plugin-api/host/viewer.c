#include "host/viewer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"

enum { CREATE = 4, UPDATE = 6, VECTOR_GRAPHICS = 8 };
enum { STROKE_COLOR = 4, STROKE = 5, BEGIN_PATH = 6, MOVE_TO = 10, LINE_TO = 11, RECT = 18 };
enum { HEAD = 256, RECT_BYTES = 17, POINT_BYTES = 9, DIGITS = 10, DIGIT_POINTS = 7 };
enum { BLOCK_BYTES = 2 * RECT_BYTES + DIGITS * DIGIT_POINTS * POINT_BYTES };

static const char *const channels[VIEWER_CHANNELS] = {"R", "G", "B", "lull.spp", "lull.p_noisy", "lull.error"};

int viewer_init(struct viewer_packet *p, const char *name, size_t pixels, uint32_t blocks)
{
    size_t tile = pixels * VIEWER_CHANNELS * sizeof(float),
           marks = (blocks < VIEWER_MARKED_BLOCKS ? blocks : VIEWER_MARKED_BLOCKS) * (size_t)BLOCK_BYTES;
    *p = (struct viewer_packet){.name = strdup(name)};
    p->at = p->name ? malloc(HEAD + strlen(name) + (tile > marks ? tile : marks)) : NULL;
    if (p->at)
        return 0;
    viewer_release(p);
    return -1;
}

void viewer_release(struct viewer_packet *p)
{
    free(p->name);
    free(p->at);
    *p = (struct viewer_packet){0};
}

static void put_u8(struct viewer_packet *p, uint8_t v) { p->at[p->size++] = v; }

static void put_i32(struct viewer_packet *p, int32_t v)
{
    base_put_u32(p->at + p->size, (uint32_t)v);
    p->size += 4;
}

static void put_i64(struct viewer_packet *p, int64_t v)
{
    base_put_u64(p->at + p->size, (uint64_t)v);
    p->size += 8;
}

static void put_f32(struct viewer_packet *p, float v) { put_i32(p, (int32_t)base_f32_bits(v)); }

static void put_text(struct viewer_packet *p, const char *text)
{
    size_t n = strlen(text) + 1;
    memcpy(p->at + p->size, text, n);
    p->size += n;
}

static void begin(struct viewer_packet *p, uint8_t type, int grab_focus)
{
    p->size = 4;
    put_u8(p, type);
    put_u8(p, (uint8_t)grab_focus);
    put_text(p, p->name);
}

static void end(struct viewer_packet *p) { base_put_u32(p->at, (uint32_t)p->size); }

static void put_channels(struct viewer_packet *p)
{
    put_i32(p, VIEWER_CHANNELS);
    for (int c = 0; c < VIEWER_CHANNELS; c++)
        put_text(p, channels[c]);
}

void viewer_create(struct viewer_packet *p, int32_t width, int32_t height)
{
    begin(p, CREATE, 1);
    put_i32(p, width);
    put_i32(p, height);
    put_channels(p);
    end(p);
}

void viewer_update(struct viewer_packet *p, const struct viewer_tile *t)
{
    begin(p, UPDATE, 0);
    put_channels(p);
    put_i32(p, t->x);
    put_i32(p, t->y);
    put_i32(p, t->width);
    put_i32(p, t->height);
    for (int c = 0; c < VIEWER_CHANNELS; c++)
        put_i64(p, c);
    for (int c = 0; c < VIEWER_CHANNELS; c++)
        put_i64(p, VIEWER_CHANNELS);
    for (int32_t y = 0; y < t->height; y++) {
        const float *row = t->rgb + (size_t)y * t->stride * 3;
        for (int32_t x = 0; x < t->width; x++) {
            for (int c = 0; c < 3; c++)
                put_f32(p, row[3 * x + c]);
            put_f32(p, t->spp);
            put_f32(p, t->p_noisy);
            put_f32(p, t->error);
        }
    }
    end(p);
}

static void command(struct viewer_packet *p, int *count, uint8_t type, int n, const float *values)
{
    put_u8(p, type);
    for (int i = 0; i < n; i++)
        put_f32(p, values[i]);
    ++*count;
}

static void rectangle(struct viewer_packet *p, int *count, const struct lull_host_block *b, int32_t x0, int32_t y0,
                      float inset)
{
    const float at[4] = {(float)(b->x0 - x0) + inset, (float)(b->y0 - y0) + inset, (float)(b->x1 - b->x0) - 2.0f * inset,
                         (float)(b->y1 - b->y0) - 2.0f * inset};
    command(p, count, RECT, 4, at);
}

/* A figure of lines through the corners 0 1 / 2 3 / 4 5 of two squares; a space lifts the pen. */
static void digit(struct viewer_packet *p, int *count, int value, float x, float y, float side)
{
    static const char *const paths[10] = {"01540",  "15",     "013245", "0154 23",  "023 15",
                                          "102354", "104532", "015",    "01540 23", "320154"};
    int pen_down = 0;
    for (const char *c = paths[value]; *c; c++) {
        if (*c == ' ') {
            pen_down = 0;
            continue;
        }
        const int corner = *c - '0';
        const float to[2] = {x + side * (float)(corner % 2), y + side * (float)(corner / 2)};
        command(p, count, pen_down ? LINE_TO : MOVE_TO, 2, to);
        pen_down = 1;
    }
}

/* In the upper left corner, where there is room for them. */
static void samples(struct viewer_packet *p, int *count, const struct lull_host_block *b, int32_t x0, int32_t y0)
{
    char text[24];
    const int n = snprintf(text, sizeof text, "%u", (unsigned)b->spp);
    const float width = (float)(b->x1 - b->x0), height = (float)(b->y1 - b->y0), least = width < height ? width : height;
    const float side = least / 16.0f < 10.0f ? least / 16.0f : 10.0f;
    if (side * (1.5f * (float)n + 2.0f) > width)
        return;
    for (int i = 0; i < n; i++)
        digit(p, count, text[i] - '0', (float)(b->x0 - x0) + side * (1.0f + 1.5f * (float)i), (float)(b->y0 - y0) + side,
              side);
}

void viewer_mark(struct viewer_packet *p, const struct lull_host_block *blocks, uint32_t n, int32_t x0, int32_t y0)
{
    static const float thin[4] = {1.0f, 1.0f, 1.0f, 0.35f}, bright[4] = {1.0f, 0.72f, 0.0f, 1.0f};
    int count = 0;
    if (n > VIEWER_MARKED_BLOCKS)
        n = 0;
    begin(p, VECTOR_GRAPHICS, 0);
    put_u8(p, 0);
    const size_t count_at = p->size;
    put_i32(p, 0);
    for (int active = 0; active < 2; active++) {
        command(p, &count, BEGIN_PATH, 0, NULL);
        for (uint32_t i = 0; i < n; i++) {
            if ((blocks[i].reason == LULL_REASON_NONE) != active)
                continue;
            rectangle(p, &count, &blocks[i], x0, y0, 0.5f);
            if (active)
                rectangle(p, &count, &blocks[i], x0, y0, 1.5f);
            else
                samples(p, &count, &blocks[i], x0, y0);
        }
        command(p, &count, STROKE_COLOR, 4, active ? bright : thin);
        command(p, &count, STROKE, 0, NULL);
    }
    base_put_u32(p->at + count_at, (uint32_t)count);
    end(p);
}
