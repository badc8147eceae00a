/*
 * Recorded levels asked about as a renderer would ask: what the stopping rule (model/stopper.h) sees of a block. A check
 * falls on the recorded level nearest to where the rule wants it, and on the last one. Pure functions but for the callback.
 */
#ifndef GGN_DATA_REPLAY_H
#define GGN_DATA_REPLAY_H

#include "data/series.h"
#include "model/stopper.h"

struct ggn_seen {
    /* NaN: no check fell on this level, or one too early for the network */
    double p;
    double correction; /* of a residual model, octaves of noise */
};

/* Fills seen [c->n_levels], as if nothing stopped the block: where it stops depends on the threshold, what is seen does not.
 * logit: of the window of these levels (indices, noisiest first). law: [c->n_levels], what the rule's evidence says of each;
 * without `reach` NULL. */
void ggn_replay(const struct ggn_level_series *c, const struct ggn_stop_rule *rule,
                double (*logit)(void *data, const int *levels), void *data, const double *law, struct ggn_seen *seen);

/* The level at which so many of these checks in a row below the threshold stop the block, -1 if none do. */
int ggn_replay_stop(const struct ggn_seen *seen, int n_levels, int passes, double threshold);

#endif
