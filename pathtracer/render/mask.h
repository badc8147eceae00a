/*
 * A region that the user wants better: a grey picture of the image's size that scales the criterion's dial per block.
 *
 * Black leaves the dial as it is, white takes a quarter of it, grey g in between 4^(-g), in steps of an eighth. The lightest
 * pixel of a block counts. The dial is the parameter `visible` if it has a value, else `threshold`. The Python package
 * (lull.mask) does the same. Plain data, no locks.
 */
#ifndef PT_RENDER_MASK_H
#define PT_RENDER_MASK_H

#include <lull/criterion.h>

#include "base/err.h"
#include "render/blocks.h"

enum { PT_MASK_STEPS = 8 };

struct pt_mask {
    int width, height;
    float *grey; /* owns; [height, width] in [0, 1], rows from the top */
};

/* Any picture file of exactly this size, colours averaged, as stored; BASE_EINVAL names what is wrong with it. */
int pt_mask_read(const char *path, int width, int height, struct pt_mask *out, struct base_err *err);
void pt_mask_release(struct pt_mask *mask);

/* In 0 … PT_MASK_STEPS: how many eighths of the way to a quarter of the dial this block goes. */
int pt_mask_step(const struct pt_mask *mask, const struct pt_block *block);

/* The factor of the dial, 1 for step 0. */
double pt_mask_scale(int step);

/* Writes the dial's pair for a step: *pair points to static text and to `value`. pairs are those of the criterion. */
int pt_mask_dial(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count, int step,
                 char value[32], struct lull_pair *pair, struct base_err *err);

#endif
