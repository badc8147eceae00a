/*
 * A block as two pictures, in the light that a display sends, whose difference is its noise and whose common part the
 * picture: what `observer` and residual models measure. Pure functions but for the tally, any thread.
 */
#ifndef GGN_PLUGIN_PAIR_H
#define GGN_PLUGIN_PAIR_H

#include <stddef.h>

#include <lull/criterion_kit.h>

#include "plugin/means.h"

/* rgb: two of [3][P]. A pixel that is no number takes the place of the one before it: neither noise nor texture; the tally
 * counts it. All return whether the pictures differ anywhere. */

/* The means of the two halves of the samples, in `area`, of P pixels: the block's own rectangle, or more of the view. There
 * the pixels of other blocks count as far as the view knows them; the rest is black in both. The view has COLOR and HALF. */
int gp_pair_of_halves(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *block,
                      struct lull_rect area, float *const rgb[2], struct lull_kit_tally *tally);
/* Likewise the mean plus and minus so many standard deviations that the second moments give its luminance; from two samples
 * on. The view has COLOR and MOMENT2. Samples are taken as independent: of stratified ones it says too much. */
int gp_pair_of_moments(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *block,
                       struct lull_rect area, double deviations, float *const rgb[2]);
/* The mean plus and minus its noise, as an earlier mean of the block tells, which is begun to be looked at. *known: whether
 * there is one. */
int gp_pair_of_means(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *block,
                     struct gp_history *means, float *const rgb[2], struct lull_kit_tally *tally, int *known);

/* Whether one picture, [3][pixels], is of more than one colour. */
int gp_pair_has_structure(const float *rgb, size_t pixels);

#endif
