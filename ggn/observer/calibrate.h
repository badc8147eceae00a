/*
 * Fitting the model observer to human thresholds, with errors that were not fitted.
 */
#ifndef GGN_OBSERVER_CALIBRATE_H
#define GGN_OBSERVER_CALIBRATE_H

#include "base/threads.h"
#include "observer/observer.h"

struct ggn_calibration_block {
    const struct ggn_seq_block *block; /* borrows */
    int reference_independent;
    double human; /* threshold, spp; blocks whose human threshold is at the cap are to be left out */
};

struct ggn_calibration {
    struct ggn_observer observer; /* the best form, tau from all blocks */
    int n;
    double median_abs_log2;        /* of log2(predicted/human), tau fitted to all blocks */
    double loo_median_abs_log2;    /* tau from the other blocks, the form chosen on all */
    double loo_mean_abs_log2;
    double nested_median_abs_log2; /* tau and form from the other blocks: the honest figure */
    double nested_mean_abs_log2;
    double spearman;
    double *predicted;             /* owns; [n]; with tau and form from the other blocks */
};

/* Tries maps, blurs, masking and percentiles on a fixed grid. tau of a form is the geometric median of the pooled values at the human
 * thresholds. n >= 3 blocks. progress may be NULL. */
int ggn_observer_calibrate(const struct ggn_calibration_block *blocks, int n, enum ggn_observer_source source,
                           struct base_threads *threads, struct ggn_calibration *out, struct base_err *err);
void ggn_calibration_release(struct ggn_calibration *c);

/*
 * Slope of the psychometric curve from raw yes/no trials `block;level;seen` (level times 20 is spp): P(seen) = Phi(log2(T_b/n)/s) with
 * a threshold T_b per block and one s for the file, by maximum likelihood. *spread gets s in octaves. Lines that are no trial are left out; *skipped counts them.
 */
int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err);

#endif
