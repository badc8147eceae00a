/*
 * Statistics of one block's film that the cheap criteria need, defined in FORMAT.md, and above all the *tail* of a block's
 * noise: what sits in few pixels. Rare bright paths, each met by one sample or none, make it; a mean over all pixels hides
 * it. Pure functions, any thread, allocate nothing.
 *
 * - The criteria halfbuf and variance are held back by the share of unsettled pixels.
 * - A quote takes top_share for light that was not met yet (plugin-api/host/quote.c).
 * - Recorded sequences keep tail999, gini and the shares of unsettled pixels (FORMAT.md).
 */
#ifndef SEQUENCE_TAIL_H
#define SEQUENCE_TAIL_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "sequence/block.h"

struct seq_tail {
    /* 99.9th percentile of the noise, element ceil(0.999 n) of the sorted values, over max(mean luminance, 1e-4) */
    double tail999;
    double gini;      /* Gini coefficient of the noise: Σ (2i − n − 1) a_i / (n Σ a_i), a sorted ascending, i from 1 */
    double top_share; /* of Σ a_i², in [0, 1]: what the noisiest ceil(n / 100) values have; 0.08 in Gaussian noise */
};

/* noise: |Y(D)| of n pixels, D the half-buffer difference that has the variance of the mean (gini and top_share: any
 * multiple of it); finite; sorted in place. n 0, or noise that is 0: zeros. */
struct seq_tail seq_tail_of(double *noise, size_t n, double mean_luminance);

/* A pixel is unsettled while its luminance may still move by more than this share of itself, or of the least luminance that
 * counts (1: display white): the defaults of the criteria halfbuf and variance. */
#define SEQ_UNSETTLED_ERROR 0.5
#define SEQ_UNSETTLED_FLOOR 0.02
/* difference: of the means of two buffers, or a standard error, >= 0; y: the pixel's luminance. */
static inline int seq_is_unsettled(double difference, double y)
{
    return difference > SEQ_UNSETTLED_ERROR * fmax(fabs(y), SEQ_UNSETTLED_FLOOR);
}

enum { SEQ_DAMMERTZ, SEQ_HALF_UNSETTLED, SEQ_RSE, SEQ_RSE_UNSETTLED, SEQ_TAIL999, SEQ_GINI, SEQ_STATISTICS };

/* mean, half_mean (of half A), half (the difference D): [3, pixels], linear; moment2: [pixels] mean squared luminance;
 * scratch: [pixels], overwritten. pixels >= 1, spp >= 1. out has the names of FORMAT.md. */
void seq_statistics(const double *mean, const double *half_mean, const double *half, const double *moment2, size_t pixels,
                    uint64_t spp, double *scratch, struct seq_stat out[SEQ_STATISTICS]);

#endif
