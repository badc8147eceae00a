/* Statistics of one block's film that cheap criteria need, defined in ggn/data/FORMAT.md. */
#ifndef PT_RENDER_BLOCKSTATS_H
#define PT_RENDER_BLOCKSTATS_H

#include <stddef.h>
#include <stdint.h>

struct pt_block_stats {
    double dammertz, half_unsettled, rse, rse_unsettled, tail999, gini;
};

/* mean, half_mean (of half A), difference D: [pixels, 3]; moment2: [pixels] means of the squared luminance;
 * scratch: [pixels], overwritten. pixels >= 1, spp >= 1. */
void pt_block_stats(const double *mean, const double *half_mean, const double *difference, const double *moment2,
                    size_t pixels, uint64_t spp, double *scratch, struct pt_block_stats *out);

#endif
