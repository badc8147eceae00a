/*
 * The statistics of evaluation: how two lists of numbers agree. Pure functions; NaN is returned where a value is undefined.
 */
#ifndef GGN_FIGURES_STATS_H
#define GGN_FIGURES_STATS_H

#include <stddef.h>

#include "base/err.h"

double ggn_stats_mean(const double *x, size_t n);
void ggn_stats_sort(double *x, size_t n); /* rising */
/* Quantile q in [0,1] of x, linear between order statistics. Sorts x. */
double ggn_stats_quantile(double *x, size_t n, double q);
double ggn_stats_pearson(const double *x, const double *y, size_t n);
/* Pearson of the ranks, ties get their mean rank. BASE_ENOMEM only. */
int ggn_stats_spearman(const double *x, const double *y, size_t n, double *rho, struct base_err *err);

/* Area under the ROC curve of `score` for telling label 1 from label 0 (Mann-Whitney; ties count half). NaN if one class is
 * empty. BASE_ENOMEM only. */
int ggn_stats_auc(const double *score, const unsigned char *label, size_t n, double *auc, struct base_err *err);
/* The cut t that maximises the accuracy of "score >= t means 1", and that accuracy. BASE_ENOMEM only. */
int ggn_stats_best_cut(const double *score, const unsigned char *label, size_t n, double *cut, double *accuracy,
                       struct base_err *err);

/* Predicted against true thresholds. */
struct ggn_agreement {
    size_t blocks, below_cap; /* below_cap: blocks whose true threshold is below the cap */
    double pearson_r, pearson_r_below_cap, spearman, spearman_below_cap;
    double mae, mae_below_cap, rmse;               /* spp */
    double share_below;                            /* share of blocks with predicted < true */
    double early_stop_rate;                        /* share with predicted < 0.8 true: noise left to be seen */
    double samples_ratio;                          /* sum of predicted / sum of true */
    double median_abs_log2, median_log2, iqr_log2; /* of log2(predicted / true) */
    double within_half, within_one;                /* share with |log2| <= 1/2, 1 */
};

/* truth, predicted: [n], all > 0; n 0: every figure is NaN. Thresholds at the cap are censored: they enter the `_below_cap`
 * figures not at all. */
int ggn_stats_agreement(const double *truth, const double *predicted, size_t n, double cap, struct ggn_agreement *out,
                        struct base_err *err);

#endif
