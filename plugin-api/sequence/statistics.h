/* Statistics of one block's film that the cheap criteria need, defined in FORMAT.md. Pure functions. */
#ifndef SEQUENCE_STATISTICS_H
#define SEQUENCE_STATISTICS_H

#include <stddef.h>
#include <stdint.h>

#include "sequence/block.h"

enum { SEQ_DAMMERTZ, SEQ_HALF_UNSETTLED, SEQ_RSE, SEQ_RSE_UNSETTLED, SEQ_TAIL999, SEQ_GINI, SEQ_STATISTICS };

/* mean, half_mean (of half A), half (the difference D): [3, pixels], linear; moment2: [pixels] mean squared luminance;
 * scratch: [pixels], overwritten. pixels >= 1, spp >= 1. out has the names of FORMAT.md. */
void seq_statistics(const double *mean, const double *half_mean, const double *half, const double *moment2, size_t pixels,
                    uint64_t spp, double *scratch, struct seq_stat out[SEQ_STATISTICS]);

#endif
