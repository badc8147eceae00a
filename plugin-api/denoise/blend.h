/*
 * A picture between the noisy and the denoised one: at each pixel alpha of the noisy, by which the mean square error is
 * least (denoise/estimate.h), from estimates that are pooled over the neighbourhood. Where the denoiser is right it is the
 * denoised picture, where it is wrong the noisy one.
 *
 * A pooled estimate is noise, too: a gain g whose standard error is s counts as g - (1.5 s)^2 / g, and as none below 1.5 s
 * (the non-negative garrote of Breiman 1995). Else the noise of the estimate would keep islands of the noisy picture where
 * nothing is wrong with the denoised one. s is the smaller of two: that from how the gain scatters over the neighbourhood,
 * which is too large where the denoiser errs on edges alone, and that from how the halves' crossings differ, which is too
 * large where noise has heavy tails.
 *
 * A pixel in which the halves are further apart than four standard deviations of its neighbourhood counts as a speck: light
 * that one sample found, and none of its neighbours'. Of noisy halves a sixteenth of its own square is at least what the
 * denoiser moved. Of denoised halves the brighter is brought down until they are so far apart and no further. Pure
 * functions, thread-safe; the same bits on every processor for the same inputs.
 */
#ifndef DENOISE_BLEND_H
#define DENOISE_BLEND_H

#include "denoise/estimate.h"

/* Pools gain, doubt and moved in place (Gaussian of 4 px, cut off where the picture ends) and fills alpha: the share of
 * the other picture, without specks. All [height][width]. */
void lull_blend_shares(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha);

/* to: [n][3]; becomes alpha of the other picture and the rest of itself. */
void lull_blend_mix(const float *other, const float *alpha, size_t n, float *to);

/* Pools the maps of the estimate but `noisy` in place (Gaussian of 4 px, cut off where the picture ends) and fills alpha
 * and apart, all [height][width]. apart: how much of the denoised halves' difference is no speck, in [0, 1]. scratch:
 * [height][width]. */
void lull_blend_weights(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha,
                        float *apart);

/* alpha from the neighbourhood alone, without the 5x5 pixels in its middle, of the whole gain. The maps as they are before
 * they are pooled; scratch: [2][height][width]. Weights that a pixel's own samples have chosen make its error look small, by
 * a third of the mean square in the scenes of docs/results/denoised.md: what crosses a blend with the other half crosses one
 * of these, whose own error is larger by a few per cent. */
void lull_blend_weights_cross_validated(const struct lull_estimate *estimate, int width, int height, float *scratch,
                                        float *alpha);

/* Takes the specks from denoised halves [n][3]. */
void lull_blend_despeckle(const float *apart, size_t n, float *fa, float *fb);

/* noisy, denoised, out: [n][3]; out may be either. Where `noisy` is no number, the denoised value. */
void lull_blend(const float *noisy, const float *denoised, const float *alpha, size_t n, float *out);

#endif
