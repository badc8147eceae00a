/*
 * A block as two pictures, in the light that a display sends, whose difference is its noise and whose common part the
 * picture: what `observer` and residual models measure. Pure functions but for the tally, any thread.
 */
#ifndef GGN_PLUGIN_PAIR_H
#define GGN_PLUGIN_PAIR_H

#include <stddef.h>

#include <lull/criterion_kit.h>

#include <stdatomic.h>

#include "plugin/means.h"

/* A block of a view, and how it is shown. */
struct gp_sight {
    const struct lull_kit *kit;
    const struct lull_view *view;
    const struct lull_block *block;
};

/* rgb: two of [3][P]. A pixel that is no number takes the place of the one before it: neither noise nor texture; the tally
 * counts it. All return whether the pictures differ anywhere. */

/* The means of the two halves of the samples, in `area`, of P pixels: the block's own rectangle, or more of the view. There
 * the pixels of other blocks count as far as the view knows them; the rest is black in both. The view has COLOR and HALF. */
int gp_pair_of_halves(const struct gp_sight *of, struct lull_rect area, float *const rgb[2], struct lull_kit_tally *tally);
/* Likewise the mean plus and minus so many standard deviations that the second moments give its luminance; from two samples
 * on. The view has COLOR and MOMENT2. Samples are taken as independent: of stratified ones it says too much. */
int gp_pair_of_moments(const struct gp_sight *of, struct lull_rect area, double deviations, float *const rgb[2]);
/* The block's own pictures: its halves, or in a frame with `means` the mean plus and minus its noise, as an earlier mean
 * tells, which is begun to be looked at. -1: there are no such halves, which `who` says unless *warned, or no earlier mean.
 * *split: what takes their difference to noise of the mean's strength. */
int gp_pair_of_block(const struct gp_sight *of, struct gp_history *means, const char *who, atomic_flag *warned,
                     float *const rgb[2], struct lull_kit_tally *tally, double *split);

/* Whether one picture, [3][pixels], is of more than one colour. */
int gp_pair_has_structure(const float *rgb, size_t pixels);

#endif
