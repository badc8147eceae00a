/* Light that samples may not have met: what no witness of noise can tell of a small block. */
#ifndef GGN_PLUGIN_UNDERSAMPLED_H
#define GGN_PLUGIN_UNDERSAMPLED_H

#include <lull/criterion_kit.h>

/* An error, in units of what is just seen, for a block of fewer than 100x100 pixels in a view with COLOR and MOMENT2; 0
 * of others. Let B be the root of a pixel's largest sum of squared deviations, a little less than its brightest sample,
 * and D a sixth of one L* at the mean of what the P pixels of the block show. A sample like B once more or less moves
 * that mean by B / (P n). The error is sqrt(2.4 B / (P D n)): at the default limit a block waits until three such samples
 * move the mean by less than D. docs/results.md has what that saves and costs. Pure, any thread. */
double gp_undersampled_error(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *block);
/* Whether light beyond the edges of a block may reach over them unseen: a pixel inside has no noise, and that of a pixel
 * which touches it from outside would be seen in it. area: about the block `own`, with the pixels at its edges; rgb: its
 * two pictures by second moments (gp_pair_of_moments). Pure, any thread. */
int gp_undersampled_edge(struct lull_rect own, struct lull_rect area, float *const rgb[2]);

#endif
