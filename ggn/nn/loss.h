/* Binary cross-entropy on logits with its gradient, in the form that never takes the logarithm of 0. */
#ifndef GGN_NN_LOSS_H
#define GGN_NN_LOSS_H

#include <math.h>

static inline double ggn_sigmoid(double logit)
{
    double e = exp(-fabs(logit));
    return logit >= 0 ? 1 / (1 + e) : e / (1 + e);
}

/* max(z, 0) − y·z + log(1 + e^−|z|): cross-entropy of the label y in [0, 1] (soft labels too) and p = sigmoid(z). */
static inline double ggn_bce(double logit, double label)
{
    return fmax(logit, 0) - label * logit + log1p(exp(-fabs(logit)));
}

/* d ggn_bce / d logit = p − y */
static inline double ggn_bce_grad(double logit, double label) { return ggn_sigmoid(logit) - label; }

#endif
