/*
 * What `observer` keeps of a frame whose host has no half buffers: of each block two earlier means, linear RGB in float.
 *
 * The running mean x1 at n1 samples and x2 at n2 > n1 hold what halves do: x2 - x1 has the variance s^2 (1/n1 - 1/n2) and
 * is uncorrelated with x2, so that (x2 - x1) sqrt(n1 / (n2 - n1)) replaces the half difference at n2. With n2 = 2 n1 it is
 * one. So the base, the mean that is compared with, is replaced whenever the samples have doubled; the mean in between is
 * the next base.
 *
 * They are a history (plugin/history.h) with a window of two images, [3][P] each. Of its stopper only the window is used.
 */
#ifndef GGN_PLUGIN_MEANS_H
#define GGN_PLUGIN_MEANS_H

#include "plugin/history.h"

/* For the blocks of a checked frame. LULL_E_MEMORY leaves *means as it was. */
int32_t gp_means_create(struct gp_history *means, const struct lull_frame *frame, struct lull_error *err);

/* Begins a check at spp >= 1 samples. *keep gets the [3][P] that the caller fills, if this mean is to be kept, else NULL.
 * Returns the mean to compare with and its samples, *spp_base < spp; NULL: there is none yet. The same spp again gets the
 * same mean. */
const float *gp_means_begin(struct gp_history *means, uint32_t id, uint64_t spp, float **keep, uint64_t *spp_base);

/* lull.state/1: all of it, checked on the way in. Writes and reads nothing where nothing is remembered. A refused state
 * leaves *means as it was. */
int32_t gp_means_save(const struct gp_history *means, const struct lull_writer *writer, struct lull_error *err);
int32_t gp_means_load(struct gp_history *means, const struct lull_reader *reader, struct lull_error *err);

#endif
