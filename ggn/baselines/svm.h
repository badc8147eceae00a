/* RBF support vector machine with balanced classes on standardised features (libsvm). One call at a time per process: libsvm
 * prints through a global hook, which this switches off. */
#ifndef GGN_BASELINES_SVM_H
#define GGN_BASELINES_SVM_H

#include <stddef.h>

#include "base/err.h"

struct ggn_svm;

/* x: [n][features], label 0 or 1, both present. c, gamma > 0 (gamma in units of 1/features). NULL on failure. */
struct ggn_svm *ggn_svm_train(const double *x, const unsigned char *label, size_t n, int features, double c, double gamma,
                              struct base_err *err);
/* Distance to the boundary, positive on the side of label 1. Thread-safe. scratch: [features]. */
double ggn_svm_score(const struct ggn_svm *svm, const double *x, double *scratch);
void ggn_svm_destroy(struct ggn_svm *svm);

#endif
