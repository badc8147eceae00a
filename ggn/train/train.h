/*
 * Training from recorded sequences to a model file.
 *
 * - Preset lull trains in two phases, because no gradient crosses between them: first the denoiser R on crops (1 − SSIM to
 *   the reference), then generator M and discriminator D (cross-entropy) on windows whose denoised images are computed once.
 * - Preset paper follows the published iteration.
 *
 * Both end with the best epoch on the validation scenes, a calibration and the choice of the stopping threshold there.
 *
 * Everything drawn is a function of (seed, step), sums have a fixed order: the same data, options and seed give the same
 * model bytes for any number of threads, also when a run is interrupted and resumed.
 */
#ifndef GGN_TRAIN_TRAIN_H
#define GGN_TRAIN_TRAIN_H

#include "train/train_plan.h"

/* Runs the plan. GGN_TRAIN_INTERRUPTED: the checkpoint of the last finished epoch is there. */
int ggn_train(const struct ggn_train_plan *plan, struct base_err *err);

#endif
