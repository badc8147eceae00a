/*
 * Reading what a host shows: checks of frames, views and blocks, and pixels in any element type, stride and normalisation.
 * Nothing here allocates or keeps state.
 */
#ifndef GGN_PLUGIN_VIEW_H
#define GGN_PLUGIN_VIEW_H

#include <lull/criterion.h>

#include "model/preprocess.h"

/* How the host shows the picture; sRGB at exposure 1 where it does not say. */
struct ggn_display gp_display_of(const struct lull_frame *frame);

/* begin_frame's arguments: sizes, blocks inside the picture, required planes present. */
int32_t gp_frame_check(const struct lull_frame *frame, uint32_t planes_required, struct lull_error *err);
const struct lull_rect *gp_frame_block(const struct lull_frame *frame, uint32_t id);

/* evaluate's arguments: sizes, planes of known form (those of `planes_used`; those of `planes_required` present). */
int32_t gp_view_check(const struct lull_view *view, uint32_t planes_used, uint32_t planes_required, struct lull_error *err);
/* NULL if the view does not have it. */
const struct lull_plane *gp_view_plane(const struct lull_view *view, unsigned index);

/* Estimates of `count` pixels of the block's row y from x on: out[pixel * channels + c]. Where there is no estimate (N = 0)
 * or the stored value is one, NaN or infinity comes out. */
void gp_view_span(const struct lull_view *view, const struct lull_plane *plane, const struct lull_block *block, int32_t x,
                  int32_t y, int32_t count, int channels, double *out);

#endif
