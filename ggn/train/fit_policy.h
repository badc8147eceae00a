/* From logits on the validation scenes to a policy. Pure functions but for scratch memory. */
#ifndef GGN_TRAIN_FIT_POLICY_H
#define GGN_TRAIN_FIT_POLICY_H

#include "data/replay.h"
#include "data/windows.h"
#include "model/policy.h"

/* Platt 1999: scale, shift that maximise the likelihood of `label` under sigmoid(scale·logit + shift); a weak prior keeps
 * scale positive and finite when the classes are separable. Without both classes the policy keeps what it has. */
void ggn_calibrate_platt(const double *logit, const double *label, int n, struct ggn_policy *policy);

/* What the stopping rule sees of the blocks of a window list under a policy, whatever its threshold. */
struct ggn_checks {
    const struct ggn_windows *windows; /* borrows */
    struct ggn_policy policy;
    struct ggn_seen *seen; /* owns; the levels of every series, one after the other */
    double *error;         /* owns; [series] scratch */
};
/* logit: of each window of `windows`. */
int ggn_checks_create(struct ggn_checks *checks, const struct ggn_windows *windows, const double *logit,
                      const struct ggn_policy *policy, struct base_err *err);
void ggn_checks_release(struct ggn_checks *checks);

/* What stopping below t does to these blocks. */
struct ggn_stopping {
    int blocks;
    double early_rate;                     /* share stopped below 0.8 of the true threshold */
    double samples_ratio;                  /* samples spent / samples at the true thresholds */
    double median_abs_log2, mean_abs_log2; /* of stop / true threshold */
};
struct ggn_stopping ggn_calibrate_stopping(const struct ggn_checks *checks, double t);

/* The threshold (in steps of 0.01) with the smallest mean |log2(stop / true)| of those that keep the early rate at or below
 * `early_rate`; 0.01 if none does. (The largest threshold that keeps the
 * rate would be 0.99 whenever the few blocks are easy. The labels are unsure themselves: a caller that wants a margin asks
 * for fewer viewers than half, and a margin here as well would count it twice.) Returns what it does. */
struct ggn_stopping ggn_calibrate_threshold(const struct ggn_checks *checks, double early_rate, double *threshold);

/* Mean fall of the calibrated logit per octave of samples near the threshold. */
double ggn_calibrate_slope(const struct ggn_windows *windows, const double *logit, const struct ggn_policy *policy);

#endif
