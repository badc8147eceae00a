/*
 * How a trained model is to be used: cadence, calibration, threshold. Chosen on validation scenes by the trainer. In a
 * model file: the model's calibration, and what that does not have as "policy" in its provenance. A plain value, pure
 * functions, any thread.
 */
#ifndef GGN_MODEL_POLICY_H
#define GGN_MODEL_POLICY_H

#include <stddef.h>

#include "base/err.h"
#include "sight/preprocess.h"

struct cJSON;

enum { GGN_POLICY_LEVELS = 256 };

struct ggn_policy {
    double first_spp; /* samples of the first image of a window */
    double ratio;     /* samples of one image to those of the one before, > 1; 0: levels are step_spp apart */
    double step_spp;
    /* calibration: p_noisy = sigmoid(scale · logit + shift); 1 and 0: not calibrated (Platt 1999). A residual model's logit
     * is in octaves of noise over what is just visible: log2 of the law's error and the network's correction */
    double scale, shift;
    double threshold; /* stop when p_noisy < threshold ... */
    int passes;       /* ... in so many checks in a row */
    double slope;     /* by how much the calibrated logit falls when the samples double; for predictions; 0: not known */
    /* The samples of the images that were learned, rising, as far as they are not `ratio` or `step_spp` apart: evenly spaced
     * levels that were thinned are both in turn. Beyond the last of them ratio or step say how it goes on. */
    int n_levels;
    double level[GGN_POLICY_LEVELS];
};

struct ggn_policy ggn_policy_default(void);
/* BASE_EINVAL naming the field that is out of range. */
int ggn_policy_check(const struct ggn_policy *policy, struct base_err *err);

/* The parameters that users may set over the model's own policy, by name: visible (the threshold), passes, first-spp.
 * Returns 0 if there is none of this name. */
int ggn_policy_adjust(struct ggn_policy *policy, const char *name, double value);

/* Calibrated probability; 1 for a logit that is not finite. */
double ggn_policy_p(const struct ggn_policy *policy, double logit);
/* Samples at which a block last judged at `spp` is to be judged again; > spp. */
double ggn_policy_next(const struct ggn_policy *policy, double spp);
/* The policy's levels are those of images with so many samples, rising, as far as ratio and step do not tell them. */
void ggn_policy_set_levels(struct ggn_policy *policy, const double *spp, int n);
/* Where levels, rising, are not those that a policy asks for: from the first image on, each next one is looked for, and the
 * nearest level must be less than half a step or one sample away. Returns 1 with the first that is not: the level that is
 * asked for, and the nearest. A single one is the seam at the end of a recording. */
int ggn_policy_levels_differ(const struct ggn_policy *policy, const double *spp, int n_levels, double *asked,
                             double *nearest);
/* Samples at which p is expected to fall below `threshold`, from p at spp; at least spp. NaN if the slope is not known. */
double ggn_policy_predict(const struct ggn_policy *policy, double p, double threshold, double spp);

/* What surrounds a picture that a model judges. A model knows what it has learned with. Exposure is not among it: that is
 * part of what is seen, as the lamps' strength is, and models learn with both. */
struct ggn_setting {
    int width, height; /* of a whole block */
    enum ggn_transfer transfer;
};
/* Puts into `text` in which way `here` is another setting than the learned one, "blocks of 64x64 pixels instead of 200x200,
 * a gamma instead of sRGB", and returns the length: 0 where nothing is. */
size_t ggn_setting_difference(const struct ggn_setting *learned, const struct ggn_setting *here, char *text, size_t room);

/* All fields but passes as members of a JSON object, or those alone that a model's calibration has no place for. */
void ggn_policy_put(struct cJSON *to, const struct ggn_policy *policy, int only_own, int *failed);
/* BASE_EINVAL when a field is no number or out of range; fields that are missing stay those of `p`. */
int ggn_policy_get(const struct cJSON *from, struct ggn_policy p, int only_own, struct ggn_policy *policy,
                   struct base_err *err);
/* A whole policy, for models that are no networks. */
void ggn_policy_print(struct cJSON *to, const struct ggn_policy *policy, int *failed);
/* Fields that are missing keep their default, but for passes. */
int ggn_policy_parse(const struct cJSON *from, struct ggn_policy *policy, struct base_err *err);

#endif
