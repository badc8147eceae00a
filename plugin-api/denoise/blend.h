/*
 * What a denoised picture gains by a share of another one, from two halves of the samples and no reference.
 *
 * A and B are the means of the halves, M that of all samples, F the denoiser, D = (F(A) + F(B)) / 2 the picture, T the
 * truth. The other picture, X = (X(A) + X(B)) / 2, is the noisy one (X(A) = A) or that of another denoiser. Of all D + alpha
 * (X - D) the one with the least mean square error has
 *
 *     alpha = E (D - T)(D - X) / E (D - X)^2
 *
 * whether the errors of D and X are independent or not. They are not, since both are made of the same samples: where the
 * denoiser only averages, alpha of the noisy picture is 0. In the numerator the half that a picture is not made of stands
 * for T, unbiased and independent of it,
 *
 *     E ((F(A) - B)(F(A) - X(A)) + (F(B) - A)(F(B) - X(B))) / 2 - (F(A) - F(B))((F(A) - X(A)) - (F(B) - X(B))) / 4
 *
 * exactly, with the denoiser's bias in it. Nothing so sharp can be said of F of all samples: it keeps bright specks that it
 * removes from either half, where they stand out more. Differences of luminance count with the slope of L* at the denoised
 * value: L* itself of a noisy B would be biased. A single pixel's estimate is noise and often negative: pool. How strong its
 * noise is, the halves tell by their differences, in which the denoiser's bias cancels.
 *
 * The blend takes at each pixel alpha of the noisy picture, from estimates that are pooled over the neighbourhood. Where the
 * denoiser is right it is the denoised picture, where it is wrong the noisy one.
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
 * functions, thread-safe; those of the blend give the same bits on every processor for the same inputs.
 */
#ifndef DENOISE_BLEND_H
#define DENOISE_BLEND_H

#include <stddef.h>

struct lull_estimate_in { /* luminance, 1 = the display's white; [n]; finite */
    const float *a, *b;   /* the halves */
    const float *fa, *fb; /* denoised */
    const float *xa, *xb; /* of the other picture; a and b of the noisy one */
    double share;         /* of all samples that are in A, in (0, 1) */
};

struct lull_estimate { /* squares of L*; [n] each, the caller's */
    float *gain;       /* (D - T)(D - X), unbiased; may be negative */
    float *doubt;      /* the square of its noise: fourth powers of L* */
    float *moved;      /* (D - X)^2 */
    float *agreed;     /* (F(A) - F(B))^2 / 4 */
    float *noisy;      /* variance of M */
};

/* The derivative of L* by Y (CIE 15:2004), Y = 1 at white; goes on above it. */
double lull_lightness_slope(double y);

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out);

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
