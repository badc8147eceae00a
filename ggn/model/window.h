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

#include "nn/real.h"

/* Of a code of the noise map, on its way into the network: noise at the threshold of sight is one to three codes. */
#define GGN_NOISE_MAP_GAIN (16.0F / 255)

/* Tiles of size `tile` that cover `size` pixels, evenly spread, overlapping as needed: their number, and where one begins.
 * A block smaller than a tile is one tile at 0, continued by reflection. */
int ggn_tile_count(int size, int tile);
int ggn_tile_start(int size, int tile, int index);

enum { GGN_FIXED_ONE = 65535, GGN_FIXED_NAN = 65535 };
/* Whether none of the values is GGN_FIXED_NAN: a denoiser whose weights overflow must not look converged. */
int ggn_fixed_is_finite(const uint16_t *values, size_t count);

/* Copies the tile at (x0, y0) of a planar image into a planar tile, dst(c, y, x) = src · scale. dst_row and dst_plane are
 * the distances in elements between rows and planes of dst. Beyond the edge the image is reflected (… c b a | a b c …). */
void ggn_tile_load_u8(const uint8_t *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale,
                      real *dst, size_t dst_row, size_t dst_plane);
/* The same of an image of one plane. */
void ggn_tile_load_plane(const uint8_t *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale,
                         real *dst, size_t dst_row);
void ggn_tile_load_u16(const uint16_t *src, int width, int height, int x0, int y0, int tile_w, int tile_h, real scale,
                       real *dst, size_t dst_row, size_t dst_plane);
/* Stores the part of a tile in [0, 1] that lies inside the image, rounded to 16-bit fixed point; NaN becomes
 * GGN_FIXED_NAN. */
void ggn_tile_store_u16(uint16_t *dst, int width, int height, int x0, int y0, int tile_w, int tile_h, const real *src,
                        size_t src_row, size_t src_plane);

#endif
