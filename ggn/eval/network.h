/*
 * A trained model as a method of evaluation: every block's levels go through it as they would in the renderer.
 */
#ifndef GGN_EVAL_NETWORK_H
#define GGN_EVAL_NETWORK_H

#include "eval/method.h"
#include "model/judge.h"

/*
 * Scores are p_noisy; cut and passes are those of the model's policy, its gate and its tail guard hold blocks back as in the criterion (the network is
 * asked all the same, so that every window has a score). Levels before the policy's first or closer together than its ratio are passed over and get no
 * score. Beyond the recording the guard's statistics are scaled from the last recorded level.
 */
int ggn_eval_network(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model, const char *name,
                     enum ggn_precision precision, struct base_threads *threads, struct base_err *err);

/* Up to four blocks of the split: the first level, what the denoiser makes of it, and the reference, with their SSIM. */
int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split,
                              struct base_err *err);
/* One block of the split at its first window, the one at its threshold, and its last: the image, the noise feature maps of the denoised and of the noisy
 * window, and how they differ; the probability above each. */
int ggn_eval_feature_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split,
                             struct base_err *err);

#endif
