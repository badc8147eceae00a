/*
 * Fitting the observer to human thresholds, judged on views that had no part in the fit.
 *
 * The level is the one with the least sum of |log2(predicted / human)| over the blocks of all views. Predictions are
 * compared in samples of the study (ggn_observer_to_study), cut at its highest count as people's answers are. Every figure
 * of the table is of a view that was left out of its own fit.
 */
#ifndef GGN_OBSERVER_CALIBRATE_H
#define GGN_OBSERVER_CALIBRATE_H

#include "base/threads.h"
#include "data/dataset.h"
#include "data/thresholds.h"
#include "sight/curve.h"
#include "sight/observer.h"

struct ggn_calibration_input {
    const struct ggn_dataset_view *view; /* borrows */
    const struct ggn_view *human;        /* borrows; as many thresholds as the view has blocks when it is whole */
};

struct ggn_calibration_block {
    int view;
    uint32_t id;
    double human, predicted; /* spp of the study, at most SEQ_STUDY_CAP; predicted without this view */
};

struct ggn_calibration_row { /* of e = log2(predicted / human) */
    const char *name;        /* of the view; borrows */
    int blocks;
    double level;                                                    /* fitted without this view */
    double median_abs_log2, mean_abs_log2, median_log2, share_below; /* share_below: e < log2(0.8), noise left to be seen */
    double spearman;
};

struct ggn_calibration {
    struct ggn_observer observer; /* from all views; spread: of e among uncensored blocks, in samples of the observer */
    int n_views, n_blocks;
    struct ggn_calibration_row *views, all; /* owns; [n_views]; each view left out */
    struct ggn_calibration_block *blocks;   /* owns; [n_blocks], view by view */
};

/* At least two views. BASE_EINVAL also where thresholds are for another number of blocks. */
int ggn_calibrate(const struct ggn_calibration_input *inputs, int n, enum ggn_curve_source source,
                  struct base_threads *threads, struct ggn_calibration *out, struct base_err *err);
void ggn_calibration_release(struct ggn_calibration *c);

/* The observer's parameters as JSON, with the table; ggn_observer_read reads it. */
int ggn_calibration_write(const char *path, const struct ggn_calibration *c, struct base_err *err);

/* Slope of the psychometric curve from raw yes/no trials `block;level;seen` (level times 20 is spp): P(seen) =
 * Phi(log2(T_b/n)/s) with a threshold T_b per block and one s for the file, by maximum likelihood. *spread gets s in
 * octaves. Lines that are no trial are left out; *skipped counts them. */
int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err);

#endif
