/*
 * The observer on a whole recorded view, its blocks in parallel: labels, and how labels from halves agree with recorded
 * levels.
 */
#ifndef GGN_OBSERVER_VIEWS_H
#define GGN_OBSERVER_VIEWS_H

#include "base/threads.h"
#include "data/dataset.h"
#include "sight/curve.h"
#include "sight/observer.h"

/* curves: [n_blocks of the view], in the manifest's order; the caller releases each. On failure there is none to release. */
int ggn_view_curves(const struct ggn_dataset_view *view, enum ggn_curve_source source, struct base_threads *threads,
                    struct ggn_curve *curves, struct base_err *err);

/* Thresholds of all blocks. The caller releases labels. */
int ggn_view_label(const struct ggn_observer *observer, const struct ggn_dataset_view *view, enum ggn_curve_source source,
                   struct base_threads *threads, struct ggn_labels *labels, struct base_err *err);

struct ggn_check {
    uint32_t id;
    double recorded, halves; /* thresholds, spp */
    int beyond;              /* recorded lies beyond the last recorded level, which it then is */
    double curve; /* median over the recorded levels of the shift between the two curves in octaves of samples, whatever the
                   * limit: positive where halves ask for more; NaN if no recorded level shows noise */
};

/* checks: [n_blocks of the view]. */
int ggn_view_check(const struct ggn_observer *observer, const struct ggn_dataset_view *view, struct base_threads *threads,
                   struct ggn_check *checks, struct base_err *err);

#endif
