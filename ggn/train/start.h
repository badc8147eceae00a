/* Starting points of a training that differ from random, and what undoes them. Pure functions on weights. */
#ifndef GGN_TRAIN_START_H
#define GGN_TRAIN_START_H

#include "model/networks.h"
#include "nn/weights.h"

/*
 * M is trained on windows whose first S − 1 images x_k are replaced by g·(x_k − x_S): near the threshold the noise is a
 * hundredth of the picture's contrast, and a network that has to learn the subtraction first learns little else. The map is
 * linear and invertible, so it can be folded into M's first convolution: with W' learned on the differences,
 *     W_k = g·W'_k (k < S),   W_S = W'_S − g·Σ_k W'_k
 * gives the same network on plain images. `back`: the inverse. g 0: nothing to be done.
 */
void ggn_train_fold(const struct ggn_graph *generator, float *params, int window, double g, int back);

/*
 * Makes R hand its input on: three channels of the first two convolutions, of skip 0 and of the last stage carry the picture
 * (centre taps 1), the rest of a random initialisation is kept beside them, and the last 1×1 convolution reads mostly those
 * three: sigmoid(4·(x − 1/2)) ≈ x. Training then starts at the noisy image's SSIM instead of at that of a grey one.
 */
void ggn_train_identity(const struct ggn_graph *denoiser, float *params);

#endif
