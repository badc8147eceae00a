/*
 * Slope of the psychometric curve from raw yes/no trials `block;level;seen` (level times 20 is spp): P(seen) =
 * Phi(log2(T_b/n)/s) with a threshold T_b per block and one s for the file, by maximum likelihood.
 */
#ifndef GGN_OBSERVER_TRIALS_H
#define GGN_OBSERVER_TRIALS_H

#include "base/err.h"

/* *spread gets s in octaves. Lines that are no trial are left out; *skipped counts them. */
int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err);

#endif
