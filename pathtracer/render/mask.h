/*
 * A region that the user wants better: a grey picture of the image's size that scales the criterion's dial per block
 * (lull_host_config.mask). Plain data, no locks.
 */
#ifndef PT_RENDER_MASK_H
#define PT_RENDER_MASK_H

#include <lull/criterion.h>

#include "base/err.h"

struct pt_mask {
    int width, height;
    float *grey; /* owns; [height, width] in [0, 1], rows from the top */
};

/* Any picture file of exactly this size, colours averaged, as stored; BASE_EINVAL names what is wrong with it. */
int pt_mask_read(const char *path, int width, int height, struct pt_mask *out, struct base_err *err);
void pt_mask_release(struct pt_mask *mask);

/* It as a plane of the ABI; borrows the mask's pixels. */
struct lull_plane pt_mask_plane(const struct pt_mask *mask);

#endif
