/*
 * Whether a block's noise sits in few pixels: what the tail guard of the criterion ggn looks at, and what recorded sequences
 * keep of it. Pure function, any thread, allocates nothing.
 */
#ifndef SEQUENCE_TAIL_H
#define SEQUENCE_TAIL_H

#include <stddef.h>

struct seq_tail {
    /* 99.9th percentile of the noise, element ceil(0.999 n) of the sorted values, over max(mean luminance, 1e-4) */
    double tail999;
    double gini; /* Gini coefficient of the noise: Σ (2i − n − 1) a_i / (n Σ a_i), a sorted ascending, i from 1 */
};

/* noise: |Y(D)| of n pixels, D the half-buffer difference that has the variance of the mean; finite; sorted in place. n 0:
 * zeros. */
struct seq_tail seq_tail_of(double *noise, size_t n, double mean_luminance);

#endif
