/*
 * How wrong a denoised picture is, from two halves of the samples and no reference.
 *
 * A and B are the means of the halves, M that of all samples, F the denoiser. B is unbiased and independent of F(A), so
 *
 *     mse(F(A)) = E (F(A) - B)^2 - var(B),     var(B) from (A - B)^2
 *
 * holds with the denoiser's bias in it; likewise for F(B), and the two are averaged. F(M) has twice the samples: mse(F(M))
 * is taken as mse(F(half)) - var(F(half)) / 2, with var(F(half)) from (F(A) - F(B))^2 / 2, and never as less than
 * (F(A) - F(B))^2 / 4, by which the two halves already disagree. Differences of luminance count with the slope of L* at the
 * denoised value: L* itself of a noisy B would be biased. A single pixel's estimate is noise and often negative: pool, then
 * take the larger of the two. Pure functions, thread-safe.
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
    float *denoised;   /* mse of F(M), unbiased; may be negative */
    float *agreed;     /* (F(A) - F(B))^2 / 4: the pooled mse of F(M) is at least the pooled one of this */
    float *noisy;      /* variance of M */
};

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out);

#endif
