/*
 * Samples inside a block: of one wave, cells of N x N pixels get more or fewer, as the noise seen in them so far asks for.
 *
 * The observer pools what is seen of a patch's noise by a norm of 6, so that its error after n_k samples in cell k goes with
 * sum s_k^p n_k^(-p/2), p = 6, where s_k is the visible noise of one sample. For a fixed sum of n_k this is least at
 * n_k ~ s_k^(2p/(p+2)) = s_k^(3/2) (the derivative by each n_k is the same), if s_k is known. It is estimated, and rare
 * bright samples have not come yet in cells that look quiet: weights from some samples, tried on others, are best at half
 * of that exponent, s_k^(3/4) (docs/speed.md). s_k is the root mean square of half the difference of the two halves in
 * CIE L*, times sqrt(n_k): what a display shows of it, so that bright parts do not get all.
 *
 * - Weights are powers of two in [1/2, 4], a cell's samples lie between half and four times the mean of its block. The
 *   block's spp is that mean.
 * - They are chosen before a wave from the samples before it; inside a wave nothing is looked at. A row's weight comes from
 *   the rows of the other parity in its cell: how many samples a pixel gets does not depend on what they were, else pixels
 *   that were too bright so far would be mended and those that were too dark would stay (a bias of the order 1/n). Only over
 *   two waves do a row's samples come back to it, since they decide how well the others are known: nothing is found of that
 *   from cells of 8 px on (tests/stat/pt_cells.c), and smaller ones are not offered.
 * - Samples of a pixel are the first of its own sequence, PT_CELLS_STEP more at a time: so many are split evenly between the
 *   halves (pt_film_in_half), and half A has half of every pixel's samples.
 *
 * What was chosen is kept in the film, so that it is saved, sent and restored with it. Different blocks may be planned at
 * the same time.
 */
#ifndef PT_RENDER_CELLS_H
#define PT_RENDER_CELLS_H

#include <stddef.h>
#include <stdint.h>

#include "render/film.h"

enum { PT_CELLS_STEP = 8, PT_CELLS_SPP_MAX = 1 << 28 };

/* A wave of one block. */
struct pt_cells_wave {
    int x0, y0, x1, y1; /* pixels, end exclusive */
    int cell;           /* N */
    uint32_t to;        /* samples per pixel at its end, in the mean over the block; a multiple of PT_CELLS_STEP */
};

/* Bytes of scratch memory for a block of this size. */
size_t pt_cells_scratch(int width, int height, int cell);
/* Fills film->goal of the block's pixels, unless one of them has not reached its goal yet: then its wave is under way. */
void pt_cells_plan(struct pt_film *film, const struct pt_cells_wave *wave, void *scratch);

/* Samples that a pixel has when its block has got `now` of the `to` samples of the wave, at least the `spp` that it has: the
 * same whatever the steps on the way, `goal` at the end. */
static inline uint32_t pt_cells_reach(uint32_t spp, uint32_t goal, uint32_t now, uint32_t to)
{
    const uint32_t part = (uint32_t)((uint64_t)goal * now / to) / PT_CELLS_STEP * PT_CELLS_STEP;
    return part > spp ? part : spp;
}

#endif
