/*
 * What trainer, evaluation and criterion must do alike with a block's images: fixed point of denoised images, noise
 * maps, tiles of blocks that have another size than the network. Pure functions, any thread.
 *
 * A block's image is planar here: [3][height][width], all of R, then G, then B; display code 0..255 (noisy) or 16-bit
 * fixed point (denoised): code/65535, where 65534 stands for everything up to 1 and 65535 is no number.
 */
#ifndef GGN_MODEL_WINDOW_H
#define GGN_MODEL_WINDOW_H

#include <stddef.h>
#include <stdint.h>

#include "nn/graph.h"
#include "nn/real.h"

/* Of a code of the noise map, on its way into the network: noise at the threshold of sight is one to three codes. */
#define GGN_NOISE_MAP_GAIN (16.0F / 255)

/* Tiles of size `tile` that cover `size` pixels, evenly spread, overlapping as needed: their number, and where one begins.
 * A block smaller than a tile is one tile at 0, continued by reflection. */
static inline int ggn_tile_count(int size, int tile) { return size <= tile ? 1 : (size + tile - 1) / tile; }

static inline int ggn_tile_start(int size, int tile, int index)
{
    const int n = ggn_tile_count(size, tile);
    return n == 1 ? 0 : (int)((long)(size - tile) * index / (n - 1));
}

enum { GGN_FIXED_ONE = 65535, GGN_FIXED_NAN = 65535 };
/* Whether none of the values is GGN_FIXED_NAN: a denoiser whose weights overflow must not look converged. */
static inline int ggn_fixed_is_finite(const uint16_t *values, size_t count)
{
    uint16_t highest = 0;

    for (size_t i = 0; i < count; i++)
        highest = values[i] > highest ? values[i] : highest;
    return highest < GGN_FIXED_NAN;
}

/* Copies the tile at (x0, y0) of an image of so many planes to planes of the size of `v`, the first at dst, times scale.
 * Beyond the edge the image is reflected (… c b a | a b c …). */
void ggn_tile_load_u8(const uint8_t *src, int planes, int width, int height, int x0, int y0, real scale, real *dst,
                      const struct ggn_value *v);
void ggn_tile_load_u16(const uint16_t *src, int planes, int width, int height, int x0, int y0, real scale, real *dst,
                       const struct ggn_value *v);
/* Stores the part of a tile of three planes in [0, 1] that lies inside the image, rounded to 16-bit fixed point; NaN becomes
 * GGN_FIXED_NAN. */
void ggn_tile_store_u16(uint16_t *dst, int width, int height, int x0, int y0, const real *src, const struct ggn_value *v);

#endif
