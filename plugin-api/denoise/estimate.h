/*
 * What a denoised picture gains by a share of the noisy one, from two halves of the samples and no reference.
 *
 * A and B are the means of the halves, M that of all samples, F the denoiser, D = (F(A) + F(B)) / 2 the picture, T the truth.
 * Of all D + alpha (M - D) the one with the least mean square error has
 *
 *     alpha = E (D - T)(D - M) / E (D - M)^2
 *
 * whether the errors of D and M are independent or not. They are not, since D is made of the same samples: where the denoiser
 * only averages, alpha is 0. The numerator is mse(D) less the covariance of both errors. B is unbiased and independent of F(A),
 * so
 *
 *     mse(F(A)) = E (F(A) - B)^2 - var(B),     var(B) from (A - B)^2
 *
 * holds with the denoiser's bias in it, likewise for F(B); mse(D) is the mean of the two less (F(A) - F(B))^2 / 4, exactly.
 * The covariance is that of F(A) with A and of F(B) with B: (F(A) - F(B)) (A - B) / 4. Nothing so sharp can be said of F of all
 * samples: it keeps bright specks that it removes from either half, where they stand out more. Differences of luminance
 * count with the slope of L* at the denoised value: L* itself of a noisy B would be biased. A single pixel's estimate is
 * noise and often negative: pool. How strong that noise is, the two crossings tell by their difference, in which the error of the
 * denoiser cancels. Pure functions, thread-safe.
 */
#ifndef DENOISE_ESTIMATE_H
#define DENOISE_ESTIMATE_H

#include <stddef.h>

struct lull_estimate_in { /* luminance, 1 = the display's white; [n]; finite */
    const float *a, *b;   /* the halves */
    const float *fa, *fb; /* denoised */
    double share;         /* of all samples that are in A, in (0, 1) */
};

struct lull_estimate { /* squares of L*; [n] each, the caller's */
    float *gain;       /* (D - T)(D - M), unbiased; may be negative */
    float *doubt;      /* fourth powers of L*: by how much the crossings of either half differ, a quarter of its square */
    float *moved;      /* (D - M)^2 */
    float *agreed;     /* (F(A) - F(B))^2 / 4 */
    float *noisy;      /* variance of M */
};

/* The derivative of L* by Y (CIE 15:2004), Y = 1 at white; goes on above it. */
double lull_lightness_slope(double y);

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out);

#endif
