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
/* Pearson's coefficient of the ranks, ties get their mean rank. BASE_ENOMEM only. */
int ggn_stats_spearman(const double *x, const double *y, size_t n, double *rho, struct base_err *err);

/* Area under the ROC curve of `score` for telling label 1 from label 0 (Mann-Whitney; ties count half). NaN if one class is
 * empty. BASE_ENOMEM only. */
int ggn_stats_auc(const double *score, const unsigned char *label, size_t n, double *auc, struct base_err *err);

#endif
