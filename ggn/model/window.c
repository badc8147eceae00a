#include "model/window.h"

#include <math.h>

#include "nn/real.h"

/* Position inside [0, size) of position i >= 0 of the endless reflection. */
static int reflect(int i, int size)
{
    int k = i % (2 * size);
    return k < size ? k : 2 * size - 1 - k;
}

#define TILE_LOAD(NAME, TYPE) \
    void NAME(const TYPE *src, int planes, int width, int height, int x0, int y0, real scale, real *dst, \
              const struct ggn_value *v) \
    { \
        const int inside = width - x0 < v->w ? width - x0 : v->w; \
\
        for (int i = 0; i < planes * v->h; i++) { \
            const int c = i / v->h, y = i % v->h; \
            const TYPE *from = src + ((size_t)c * (size_t)height + (size_t)reflect(y0 + y, height)) * (size_t)width; \
            real *to = dst + (size_t)c * v->plane + (long)y * v->row; \
            for (int x = 0; x < inside; x++) \
                to[x] = (real)from[x0 + x] * scale; \
            for (int x = inside; x < v->w; x++) \
                to[x] = (real)from[reflect(x0 + x, width)] * scale; \
        } \
    }
TILE_LOAD(ggn_tile_load_u8, uint8_t)
TILE_LOAD(ggn_tile_load_u16, uint16_t)

void ggn_tile_store_u16(uint16_t *dst, int width, int height, int x0, int y0, const real *src, const struct ggn_value *v)
{
    const int w = width - x0 < v->w ? width - x0 : v->w, h = height - y0 < v->h ? height - y0 : v->h;
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < h; y++) {
            const real *from = src + (size_t)c * v->plane + (long)y * v->row;
            uint16_t *to = dst + ((size_t)c * (size_t)height + (size_t)(y0 + y)) * (size_t)width + x0;
            for (int x = 0; x < w; x++) {
                real positive = from[x] > 0 ? from[x] : 0, code = positive * GGN_FIXED_ONE + (real)0.5;
                to[x] = isnan(from[x]) ? GGN_FIXED_NAN : (uint16_t)(code < GGN_FIXED_NAN ? code : GGN_FIXED_NAN - 1);
            }
        }
}
