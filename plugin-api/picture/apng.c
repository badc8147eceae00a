#include "picture/apng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "picture/png.h"

enum { SIGNATURE = 8, AROUND = 12, WORD = 4 }; /* bytes: of a file's head, of a chunk's length, name and checksum */

static void put_word(uint8_t *at, uint32_t v)
{
    for (int i = 0; i < WORD; i++)
        at[i] = (uint8_t)(v >> (24 - 8 * i));
}

static uint32_t word_at(const uint8_t *at)
{
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

/* A chunk of up to two parts. Failures are found by base_file_commit. */
static void write_chunk(FILE *f, const char *name, const void *first, uint32_t first_size, const void *second,
                        uint32_t second_size)
{
    uint8_t word[WORD];
    uint32_t sum = (uint32_t)crc32(crc32(0, (const Bytef *)name, WORD), first, first_size);
    put_word(word, first_size + second_size);
    fwrite(word, 1, WORD, f);
    fwrite(name, 1, WORD, f);
    fwrite(first, 1, first_size, f);
    if (second_size > 0) {
        fwrite(second, 1, second_size, f);
        sum = (uint32_t)crc32(sum, second, second_size);
    }
    put_word(word, sum);
    fwrite(word, 1, WORD, f);
}

/* Width, height and time of the frame that follows, which replaces the one before. */
static void write_frame_head(struct pic_apng *a)
{
    uint8_t c[26] = {0};
    put_word(c, a->chunks++);
    put_word(c + 4, (uint32_t)a->width);
    put_word(c + 8, (uint32_t)a->height);
    for (int i = 0; i < 4; i++)
        c[20 + i] = (uint8_t)(a->delay[i / 2] >> (i % 2 ? 0 : 8));
    write_chunk(a->file.file, "fcTL", c, sizeof c, NULL, 0);
}

/* One chunk of a frame's own PNG. The first frame's all stay; of the others the compressed pixels do, under another name. */
static void take_chunk(struct pic_apng *a, const uint8_t *chunk, uint32_t size, int *is_open)
{
    FILE *f = a->file.file;
    const char *name = (const char *)chunk + WORD;
    const int is_pixels = memcmp(name, "IDAT", WORD) == 0, is_end = memcmp(name, "IEND", WORD) == 0;
    if (is_pixels && !*is_open) {
        if (a->frame == 0) {
            uint8_t c[8] = {0}; /* how many; how often: 0, for ever */
            put_word(c, a->frames);
            write_chunk(f, "acTL", c, sizeof c, NULL, 0);
        }
        write_frame_head(a);
        *is_open = 1;
    }
    if (is_pixels && a->frame > 0) {
        uint8_t number[WORD];
        put_word(number, a->chunks++);
        write_chunk(f, "fdAT", number, WORD, chunk + 2 * WORD, size);
    } else if (a->frame == 0 && !is_end) {
        fwrite(chunk, 1, AROUND + size, f);
    }
}

int pic_apng_begin(struct pic_apng *a, const char *path, int32_t width, int32_t height, uint32_t frames, double fps,
                   struct base_err *err)
{
    const uint16_t parts = fps <= 60.0 ? 1000 : 250; /* as fine as 16 bits have room for */
    *a = (struct pic_apng){
        .width = width, .height = height, .frames = frames, .delay = {parts, (uint16_t)lround(parts * fps)}};
    return base_file_begin(&a->file, path, err);
}

int pic_apng_add(struct pic_apng *a, const uint8_t *rgb, struct base_err *err)
{
    uint8_t *png;
    size_t size;
    int is_open = 0, rc = pic_png_bytes(a->width, a->height, rgb, &png, &size, err);
    if (rc)
        return rc;
    if (a->frame == 0)
        fwrite(png, 1, SIGNATURE, a->file.file);
    for (size_t at = SIGNATURE; at + AROUND <= size;) {
        const uint32_t length = word_at(png + at);
        take_chunk(a, png + at, length, &is_open);
        at += AROUND + length;
    }
    a->frame++;
    free(png);
    return 0;
}

int pic_apng_end(struct pic_apng *a, struct base_err *err)
{
    write_chunk(a->file.file, "IEND", "", 0, NULL, 0);
    return base_file_commit(&a->file, err);
}

void pic_apng_abort(struct pic_apng *a) { base_file_abort(&a->file); }
