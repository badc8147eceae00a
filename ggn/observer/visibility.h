/*
 * How visible a block's noise is: the kernel that labels and the criterion share.
 *
 * It looks at two pictures A and B of the same block, means of equally many samples each, as CIE L*. What differs between
 * them is noise, what they have in common is texture; neither needs a converged picture: noise    N = (L*(A) - L*(B)) / 2,
 * as strong as that of their mean; visible  (mean over the block of |N blurred by a Gaussian of 0.7 px|^4)^(1/4): a few
 * bright pixels count, people see them; texture  mean over the block of sqrt(max(0, cov(L*(A), L*(B)) - mean(N^2) / 5)),
 * both over 5x5 px. Noise does not add to a covariance, but it scatters it, by 2/5 mean(N^2) in standard error, and the root
 * of what is left above 0 would not be 0 in the mean; with half that error taken off, what it adds is nearly gone. Beyond
 * the edges of a block its outermost pixels are repeated; a block may be as small as one pixel. Pure functions on memory of
 * the caller, thread-safe; the same bits on every machine (no call of the mathematical library but one root at the end).
 */
#ifndef GGN_OBSERVER_VISIBILITY_H
#define GGN_OBSERVER_VISIBILITY_H

#include <stddef.h>

/* L* in [0, 100] of the light that a display sends for linear RGB (Rec. 709, [3][n]); each channel is clamped to [0, 1], NaN
 * is 0. */
void ggn_visible_lightness(const float *rgb, size_t n, float *lightness);

/* Doubles of scratch memory for blocks of this width. */
size_t ggn_visibility_scratch(int width);
/* noise: [height][width]. blurred: the same, what is left of it after the blur; or NULL. */
double ggn_visible_noise(const float *noise, int width, int height, double *scratch, float *blurred);
/* a, b: [height][width]. */
double ggn_visible_texture(const float *a, const float *b, int width, int height, double *scratch);

#endif
