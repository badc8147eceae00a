#include "model/window.h"

#include <math.h>

#include "nn/real.h"

int ggn_tile_count(int size, int tile) { return size <= tile ? 1 : (size + tile - 1) / tile; }

int ggn_tile_start(int size, int tile, int index)
{
    int n = ggn_tile_count(size, tile);

    return n == 1 ? 0 : (int)((long)(size - tile) * index / (n - 1));
}

/* Position inside [0, size) of position i >= 0 of the endless reflection. */
static int reflect(int i, int size)
{
    int k = i % (2 * size);

    return k < size ? k : 2 * size - 1 - k;
}

int ggn_fixed_is_finite(const uint16_t *values, size_t count)
{
    uint16_t highest = 0;

    for (size_t i = 0; i < count; i++)
        highest = values[i] > highest ? values[i] : highest;
    return highest < GGN_FIXED_NAN;
}

#define TILE_LOAD(NAME, TYPE) \
    static void NAME##_one(const TYPE *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale, \
                           real *dst, size_t dst_row) \
    { \
        int inside = width - x0 < tile_w ? width - x0 : tile_w; \
\
        for (int y = 0; y < tile_h; y++) { \
            const TYPE *from = src + (size_t)reflect(y0 + y, height) * (size_t)width; \
            real *to = dst + (size_t)y * dst_row; \
            for (int x = 0; x < inside; x++) \
                to[x] = (real)from[x0 + x] * scale; \
            for (int x = inside; x < tile_w; x++) \
                to[x] = (real)from[reflect(x0 + x, width)] * scale; \
        } \
    } \
    void NAME(const TYPE *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale, real *dst, \
              size_t dst_row, size_t dst_plane) \
    { \
        for (size_t c = 0; c < 3; c++) \
            NAME##_one(src + c * (size_t)height * (size_t)width, width, height, x0, y0, tile_w, tile_h, scale, \
                       dst + c * dst_plane, dst_row); \
    }
TILE_LOAD(ggn_tile_load_u8, uint8_t)
TILE_LOAD(ggn_tile_load_u16, uint16_t)

void ggn_tile_load_plane(const uint8_t *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale,
                         real *dst, size_t dst_row)
{
    ggn_tile_load_u8_one(src, width, height, x0, y0, tile_w, tile_h, scale, dst, dst_row);
}

void ggn_tile_store_u16(uint16_t *dst, int width, int height, int x0, int y0, int tile_w, int tile_h, const real *src,
                        size_t src_row, size_t src_plane)
{
    int w = width - x0 < tile_w ? width - x0 : tile_w, h = height - y0 < tile_h ? height - y0 : tile_h;

    for (int c = 0; c < 3; c++)
        for (int y = 0; y < h; y++) {
            const real *from = src + (size_t)c * src_plane + (size_t)y * src_row;
            uint16_t *to = dst + ((size_t)c * (size_t)height + (size_t)(y0 + y)) * (size_t)width + x0;
            for (int x = 0; x < w; x++) {
                real v = from[x] > 0 ? from[x] : 0, code = v * GGN_FIXED_ONE + (real)0.5;
                to[x] = isnan(from[x]) ? GGN_FIXED_NAN : (uint16_t)(code < GGN_FIXED_NAN ? code : GGN_FIXED_NAN - 1);
            }
        }
}
