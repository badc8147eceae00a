/*
 * A trained model as a method of evaluation: every block's levels go through it as they would in the renderer.
 */
#ifndef GGN_EVAL_NETWORK_H
#define GGN_EVAL_NETWORK_H

#include "eval/method.h"
#include "model/infer.h"

/* Levels closer together than the model's spacing are passed over, as its criterion would (their cases get no score). The method has the
 * model's own threshold and number of passes. GGN_EINVAL if the blocks are not of the model's size. */
int ggn_eval_network(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model, const char *name,
                     enum ggn_precision precision, struct ggn_threads *threads, struct ggn_err *err);

/* DIR/denoiser.png: for up to four blocks of the split, the first full level, what the denoiser makes of it, and the reference, with
 * their SSIM. */
int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model, enum ggn_split split,
                              struct ggn_err *err);

#endif
