/*
 * How wrong a denoised picture is, from two halves of the samples and no reference.
 *
 * A and B are the means of the halves, F the denoiser, D = (F(A) + F(B)) / 2 the picture. B is unbiased and independent of
 * F(A), so
 *
 *     mse(F(A)) = E (F(A) - B)^2 - var(B),     var(B) from (A - B)^2
 *
 * holds with the denoiser's bias in it; likewise for F(B). Then mse(D) is the mean of the two less (F(A) - F(B))^2 / 4,
 * exactly, and never less than (F(A) - F(B))^2 / 4, by which the halves already disagree. Nothing so sharp can be said of F
 * of all samples: it keeps bright specks that it removes from either half, where they stand out more. Differences of
 * luminance count with the slope of L* at the denoised value: L* itself of a noisy B would be biased. A single pixel's
 * estimate is noise and often negative: pool, then take the larger of the two. Pure functions, thread-safe.
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
    float *denoised;   /* mse of D, unbiased; may be negative */
    float *agreed;     /* (F(A) - F(B))^2 / 4: the pooled mse of D is at least the pooled one of this */
    float *noisy;      /* variance of the mean of all samples */
};

/* The derivative of L* by Y (CIE 15:2004), Y = 1 at white; goes on above it. */
double lull_lightness_slope(double y);

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out);

#endif
