/*
 * How visible a block's noise is: the kernel that labels and the criterion share.
 *
 * Two images A and B of the same block, means of equally many samples each, are compared in CIE L*. Their difference is
 * noise, their common part is texture that hides it; neither needs a converged image.
 *
 * - Patches: each side of the block is split into ceil(side / 100) parts, so that a patch has at most 100x100 px. One
 *   texture for a block of velvet and gold would hide the noise of the velvet.
 * - Noise N = (L*(A) - L*(B)) / 2 is as strong as that of their mean. G is N blurred by a Gaussian of 0.7 px.
 * - Texture s of a patch: the mean over it of sqrt(max(0, cov(L*(A), L*(B)) - mean(N^2) / 5)), both over 5x5 px. Noise adds
 *   nothing to a covariance, but scatters it by 2/5 mean(N^2) in standard error, and the root of the part above 0 is not 0
 *   in the mean. Half that error is taken off, so that next to nothing is added.
 * - Visible noise r of the block: the root mean square over its patches of (mean over the patch of G^6)^(1/6) / sqrt(s + 2).
 *   A norm of 6 lets a few bright pixels count, because people see them; squares let one noisy patch count beside smooth
 *   ones. sight/observer.h turns r into an answer.
 *
 * Second witness. The difference of two halves is one draw of the noise, symmetric though the noise of few bright paths is
 * not. Second moments say how large each pixel's noise is expected to be: with v the variance of the mean luminance Y,
 * d = (L*(Y + sqrt v) - L*(Y - sqrt v)) / 2 and V = d^2 blurred by the squared Gaussian, the expected sixth power of G is
 * 15 V^3, and r follows as above. A slope in the place of the finite difference would count what lies beyond white. The root
 * mean square of both r is what decides.
 *
 * Beyond the edges of a block its outermost pixels are repeated; a block may be as small as one pixel. Pure functions on
 * memory of the caller, thread-safe; the same bits on every processor (square and cube roots only).
 */
#ifndef GGN_MODEL_VISIBILITY_H
#define GGN_MODEL_VISIBILITY_H

#include <stddef.h>

/* L* in [0, 100] of the light that a display sends for linear RGB (Rec. 709, [3][n]); each channel is clamped to [0, 1], NaN
 * is 0. */
void ggn_visible_lightness(const float *rgb, size_t n, float *lightness);

/* Patches of a block, row by row. */
size_t ggn_visible_patches(int width, int height);
/* Pixels [x0, x1) x [y0, y1) of patch k as x0, y0, x1, y1; returns s + 2, what noise is divided by the root of. */
double ggn_visible_patch(int width, int height, size_t k, const double *texture, int rect[4]);
/* Doubles of scratch memory for blocks of this width. */
size_t ggn_visibility_scratch(int width);
/* a, b: L* [height][width]. texture: [patches] gets s of each. */
void ggn_visible_texture(const float *a, const float *b, int width, int height, double *scratch, double *texture);
/* Returns r. noise: N [height][width]. texture: [patches]. blurred: [height][width] gets G / sqrt(s + 2), or NULL. */
double ggn_visible_noise(const float *noise, int width, int height, const double *texture, double *scratch, float *blurred);
/* Returns the r that is expected of independent Gaussian noise in each pixel. variance: d^2 [height][width]. */
double ggn_visible_expected(const float *variance, int width, int height, const double *texture, double *scratch);
/* What both witnesses say together, r by the halves and r by the moments: the root of a mean square in which moments count a
 * fifth, since of stratified samples they say too much. */
double ggn_visible_together(double halves, double moments);

#endif
