/*
 * A picture between the noisy and the denoised one: at each pixel alpha of the noisy, alpha = mse(D) / (mse(D) + var(M)),
 * both pooled over the neighbourhood. Where the denoiser is right it is the denoised picture, where it is wrong the noisy
 * one; if the two errors were independent and known, no mixture would be better.
 *
 * A pixel in which the halves are further apart than two standard deviations of its neighbourhood counts as a speck: light
 * that one sample found, and none of its neighbours'. Of noisy halves a quarter of its own square is its var(M). Of denoised
 * halves the brighter is brought down until they are so far apart and no further. Pure functions, thread-safe; the same bits
 * on every processor for the same inputs.
 */
#ifndef DENOISE_BLEND_H
#define DENOISE_BLEND_H

#include "denoise/estimate.h"

/* Pools each map of the estimate in place (Gaussian of 3 px, cut off where the picture ends) and fills alpha and apart, all
 * [height][width]. apart: how much of the denoised halves' difference is no speck, in [0, 1]. scratch: [height][width]. */
void lull_blend_weights(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha,
                        float *apart);

/* alpha from the neighbourhood alone, without the 5x5 pixels in its middle. The maps as they are before they are pooled;
 * scratch: [3][height][width]. Weights that a pixel's own samples have chosen make its error look small, by a third of the
 * mean square in the scenes of docs/results/denoised.md: what crosses a blend with the other half crosses one of these,
 * whose own error is larger by a few per cent. */
void lull_blend_weights_blind(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha);

/* Takes the specks from denoised halves [n][3]. */
void lull_blend_despeckle(const float *apart, size_t n, float *fa, float *fb);

/* The pooled error of what is denoised, never below that on which the halves disagree. */
float lull_blend_mse(const struct lull_estimate *pooled, size_t i);

/* noisy, denoised, out: [n][3]; out may be either. Where `noisy` is no number, the denoised value. */
void lull_blend(const float *noisy, const float *denoised, const float *alpha, size_t n, float *out);

#endif
