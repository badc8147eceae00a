/*
 * A region that the user wants better: a grey picture of the image's size that scales the criterion's quality parameter per
 * block (lull_host_config.mask). Plain data, no locks.
 */
#ifndef PT_RENDER_MASK_H
#define PT_RENDER_MASK_H

#include <lull/criterion.h>

#include "base/err.h"

/* Any picture file of exactly this size, colours averaged, as stored: a plane of numbers in [0, 1] that owns its data.
 * BASE_EINVAL names what is wrong with the file. */
int pt_mask_read(const char *path, int width, int height, struct lull_plane *out, struct base_err *err);
void pt_mask_release(struct lull_plane *mask);

#endif
