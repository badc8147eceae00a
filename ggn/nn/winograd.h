/*
 * 3×3 convolution of float planes by Winograd's F(4×4, 3×3): about 3 times fewer products than the definition, at ten
 * times its rounding error (still 1e-5 relative), where the picture has enough tiles to pay for the transforms.
 */
#ifndef GGN_NN_WINOGRAD_H
#define GGN_NN_WINOGRAD_H

#include <stddef.h>

#include "nn/kernels.h"

enum {
    GGN_WINO_TILES = 64, /* most tiles of 4×4 outputs per call */
    GGN_WINO_OC = 32,    /* output channels whose products are kept at a time */
    GGN_WINO_GRAD_TILES = 32,
    GGN_WINO_GRAD_STRIDE = GGN_WINO_GRAD_TILES * GGN_WINO_GRAD + 16, /* not 4 KiB, so that stores do not collide */
    GGN_WINO_GRAD_STRIP = 4 * GGN_WINO_GRAD_TILES + 2 + 15,          /* columns of GGN_WINO_GRAD_TILES tiles in a row */
    GGN_WINO_GRAD_SCRATCH = 36 * (2 * GGN_WINO_GRAD_STRIDE + GGN_WINO_GRAD * GGN_WINO_GRAD) + 6 * 16 * GGN_WINO_GRAD_STRIP
};

/* Whether it pays for a convolution of this shape with vectors of so many lanes, and for the gradient of its weights. */
int ggn_wino_suits(int n_in, int n_out, int h, int w, int lanes);
int ggn_wino_grad_suits(int n_in, int n_out, int h, int w, int lanes);
int ggn_wino_tiles(int h, int w);
/* How the work is cut, by the shape only: into how many blocks of tiles, and into groups of how many output channels. */
void ggn_wino_cut(int tiles, int n_out, int *blocks, int *oc_group);
/* Floats of scratch for one call. */
size_t ggn_wino_scratch(int n_in);

/* u[36][tiles of n_out as in ggn_conv][n_in][tile] from a packed 3×3 convolution (ggn_conv.w). */
void ggn_wino_pack(float *u, const float *packed, int n_in, int n_out, int tile_oc);

#endif
