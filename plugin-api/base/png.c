#include "base/png.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/files.h"

enum { CHUNK_BYTES = 1 << 16 };

struct writer {
    FILE *file;
    z_stream z;
    uint8_t packed[CHUNK_BYTES];
};

static void put_be32(uint8_t *p, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        p[i] = (uint8_t)(v >> (24 - 8 * i));
}

/* Errors of writing show when the file is committed. */
static void put_chunk(FILE *f, const char type[4], const uint8_t *data, size_t size)
{
    uint8_t head[8], sum[4];
    put_be32(head, (uint32_t)size);
    memcpy(head + 4, type, 4);
    uLong crc = crc32(crc32(0, head + 4, 4), data, (uInt)size);
    put_be32(sum, (uint32_t)crc);
    fwrite(head, 1, sizeof head, f);
    fwrite(data, 1, size, f);
    fwrite(sum, 1, sizeof sum, f);
}

static void put_header(FILE *f, int32_t width, int32_t height, int channels)
{
    static const uint8_t signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, colour_types[] = {0, 4, 2, 6};
    static const uint8_t perceptual = 0;
    uint8_t ihdr[13] = {[8] = 8, [9] = colour_types[channels - 1]};
    put_be32(ihdr, (uint32_t)width);
    put_be32(ihdr + 4, (uint32_t)height);
    fwrite(signature, 1, sizeof signature, f);
    put_chunk(f, "IHDR", ihdr, sizeof ihdr);
    put_chunk(f, "sRGB", &perceptual, 1);
}

/* PNG §9.4; the neighbour nearest to left + above - corner. */
static uint8_t paeth(int left, int above, int corner)
{
    int p = left + above - corner, a = abs(p - left), b = abs(p - above), c = abs(p - corner);
    return (uint8_t)(a <= b && a <= c ? left : b <= c ? above : corner);
}

/* out[0] tells the filter, then n bytes of differences; `above` is NULL for the top row. */
static void filter_row(const uint8_t *row, const uint8_t *above, size_t n, size_t channels, uint8_t *out)
{
    out[0] = 4;
    for (size_t i = 0; i < n; i++) {
        int left = i >= channels ? row[i - channels] : 0, up = above ? above[i] : 0;
        int corner = above && i >= channels ? above[i - channels] : 0;
        out[1 + i] = (uint8_t)(row[i] - paeth(left, up, corner));
    }
}

/* Packs what is in z.next_in; each full buffer becomes a chunk, at the end the last one too. */
static void pack(struct writer *w, int flush)
{
    int status;
    do {
        status = deflate(&w->z, flush);
        if (w->z.avail_out > 0 && flush != Z_FINISH)
            return;
        if (w->z.avail_out < CHUNK_BYTES)
            put_chunk(w->file, "IDAT", w->packed, CHUNK_BYTES - w->z.avail_out);
        w->z.next_out = w->packed;
        w->z.avail_out = CHUNK_BYTES;
    } while (flush == Z_FINISH ? status == Z_OK || status == Z_BUF_ERROR : w->z.avail_in > 0);
}

static void put_pixels(struct writer *w, int32_t height, size_t row_bytes, int channels, const uint8_t *pixels, uint8_t *row)
{
    w->z.next_out = w->packed;
    w->z.avail_out = CHUNK_BYTES;
    for (int32_t y = 0; y < height; y++, pixels += row_bytes) {
        filter_row(pixels, y > 0 ? pixels - row_bytes : NULL, row_bytes, (size_t)channels, row);
        w->z.next_in = row;
        w->z.avail_in = (uInt)(row_bytes + 1);
        pack(w, Z_NO_FLUSH);
    }
    pack(w, Z_FINISH);
}

int base_png_write(const char *path, int32_t width, int32_t height, int channels, const uint8_t *pixels,
                   struct base_err *err)
{
    if (width < 1 || height < 1 || channels < 1 || channels > 4 || width > (INT32_MAX - 1) / channels)
        return base_fail(err, BASE_EINVAL, "%s: cannot write %dx%d pixels of %d channels as PNG", path, width, height,
                         channels);
    size_t row_bytes = (size_t)width * (size_t)channels;
    struct base_file_out file;
    struct writer *w = calloc(1, sizeof *w);
    uint8_t *row = malloc(row_bytes + 1);
    int rc = w && row && deflateInit(&w->z, Z_DEFAULT_COMPRESSION) == Z_OK ? 0 : base_fail_nomem(err, path);
    if (!rc) {
        rc = base_file_begin(&file, path, err);
        if (!rc) {
            w->file = file.file;
            put_header(file.file, width, height, channels);
            put_pixels(w, height, row_bytes, channels, pixels, row);
            put_chunk(file.file, "IEND", row, 0);
            rc = base_file_commit(&file, err);
        }
        deflateEnd(&w->z);
    }
    free(row);
    free(w);
    return rc;
}
