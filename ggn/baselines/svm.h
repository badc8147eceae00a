/* RBF support vector machine with balanced classes on standardised features (libsvm). Training: one call at a time per
 * process, because libsvm prints through a global hook, which this switches off. */
#ifndef GGN_BASELINES_SVM_H
#define GGN_BASELINES_SVM_H

#include <stddef.h>

#include "base/err.h"

enum { GGN_SVM_FEATURES = 256 }; /* at most */

/* Score of x: sum of coefficient[i] exp(-gamma |(x - mean) scale - support[i]|^2), minus rho. */
struct ggn_svm {
    int features, n_support;
    double gamma, rho;
    float *values;       /* owns what follows, one after the other */
    float *mean, *scale; /* [features] */
    float *coefficient;  /* [n_support] */
    float *support;      /* [n_support][features], standardised */
};

/* x: [n] rows of [features]; label 0 or 1, both present. c, gamma > 0 (gamma in units of 1/features). On failure *svm is
 * empty. */
int ggn_svm_train(struct ggn_svm *svm, const double *const *x, const unsigned char *label, size_t n, int features, double c,
                  double gamma, struct base_err *err);
/* Room for one of this size. BASE_EINVAL, BASE_ENOMEM; then *svm is empty. */
int ggn_svm_init(struct ggn_svm *svm, int features, int n_support, struct base_err *err);
/* How many there are at `values`. */
size_t ggn_svm_values(const struct ggn_svm *svm);
/* Distance to the boundary, positive on the side of label 1. Any thread; allocates nothing. */
double ggn_svm_score(const struct ggn_svm *svm, const double *x);
void ggn_svm_release(struct ggn_svm *svm);

#endif
