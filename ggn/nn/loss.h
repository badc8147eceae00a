/*
 * Losses with their gradients.
 *
 * SSIM (Wang et al. 2004): 11×11 Gaussian window, σ 1.5, zero padding, C1 = 1e-4, C2 = 9e-4, range 1, averaged over all
 * pixels of all planes. BCE on logits in the form that never takes the logarithm of 0.
 */
#ifndef GGN_NN_LOSS_H
#define GGN_NN_LOSS_H

#include "base/threads.h"
#include "nn/kernels.h"

/* max(z, 0) − y·z + log(1 + e^−|z|): cross-entropy of the label y in [0, 1] (soft labels too) and p = sigmoid(z). */
double ggn_bce(double logit, double label);
/* d ggn_bce / d logit = p − y */
double ggn_bce_grad(double logit, double label);
double ggn_sigmoid(double logit);

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/loss_decl.inc"
#undef REAL
#undef TYPED

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/loss_decl.inc"
#undef REAL
#undef TYPED

#endif
