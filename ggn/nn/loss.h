/* Binary cross-entropy on logits with its gradient, in the form that never takes the logarithm of 0. */
#ifndef GGN_NN_LOSS_H
#define GGN_NN_LOSS_H

double ggn_sigmoid(double logit);
/* max(z, 0) − y·z + log(1 + e^−|z|): cross-entropy of the label y in [0, 1] (soft labels too) and p = sigmoid(z). */
double ggn_bce(double logit, double label);
/* d ggn_bce / d logit = p − y */
double ggn_bce_grad(double logit, double label);

#endif
