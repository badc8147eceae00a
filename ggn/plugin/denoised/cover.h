/*
 * Which rectangles are denoised for the blocks of one question. A rectangle has the same bits whatever it is part of
 * (denoise/oidn.h), so neighbouring blocks share one where that is fewer pixels: what lies around them is denoised once. No
 * answer depends on it. Pure functions.
 */
#ifndef GGN_PLUGIN_DENOISED_COVER_H
#define GGN_PLUGIN_DENOISED_COVER_H

#include <lull/criterion.h>

/* What the denoiser must be given for the pixels of `core`: the cells of its grid that they lie in, its halo around those,
 * and no more than the margin of `area`, which holds core and at whose corner, less the margin, the grid begins. */
struct lull_rect gd_box_around(const struct lull_rect *core, const struct lull_rect *area);

int64_t gd_area_of(const struct lull_rect *rect);

/* Blocks that share a rectangle: `first`, next[first] ... until `last`. */
struct gd_group {
    struct lull_rect box;
    uint32_t first, last;
};

/* groups: [count], each of one block, which lie in the order of the frame or nearly so. Groups are joined while that saves
 * pixels and no box has more than `most`. Returns how many are left, in front. */
uint32_t gd_cover(struct gd_group *groups, uint32_t count, uint32_t *next, int64_t most);

#endif
