/*
 * Pictures of what a model's networks make of recorded blocks. PNG files of strips, one under the other; titles, an object,
 * gets a list of the strips' titles under the name of each file that is written (lull-plot puts them above).
 */
#ifndef GGN_EVAL_STRIPS_H
#define GGN_EVAL_STRIPS_H

#include "eval/set.h"
#include "model/model.h"

struct cJSON;

/* Up to four blocks of the split: the first level, what the denoiser makes of it, and the reference, with their SSIM. */
int ggn_eval_denoiser_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model,
                              enum ggn_split split, struct cJSON *titles, int *failed, struct base_err *err);
/* One block of the split at its first window, the one at its threshold, and its last: the image, the noise feature maps of
 * the denoised and of the noisy window, and how they differ; the probability above each. */
int ggn_eval_feature_picture(const char *path, const struct ggn_eval_set *s, const struct ggn_model *model,
                             enum ggn_split split, struct cJSON *titles, int *failed, struct base_err *err);

#endif
