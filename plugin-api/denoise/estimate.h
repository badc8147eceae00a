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
 * noise is, the halves tell by their differences, in which the denoiser's bias cancels. Pure functions, thread-safe.
 */
#ifndef DENOISE_ESTIMATE_H
#define DENOISE_ESTIMATE_H

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

#endif
