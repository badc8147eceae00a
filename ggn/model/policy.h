/*
 * How a trained model is to be used: cadence, calibration, threshold. Chosen on validation scenes by the trainer. In a
 * model file: the model's calibration, and what that does not have as "policy" in its provenance. A plain value.
 */
#ifndef GGN_MODEL_POLICY_H
#define GGN_MODEL_POLICY_H

#include <stddef.h>

#include "model/model.h"

enum { GGN_POLICY_LEVELS = 256 };

struct ggn_policy {
    double first_spp; /* samples of the first image of a window */
    double ratio;     /* samples of one image to those of the one before, > 1; 0: levels are step_spp apart */
    double step_spp;
    double scale, shift; /* calibration (Platt): p_noisy = sigmoid(scale · logit + shift) */
    double threshold;    /* stop when p_noisy < threshold ... */
    int passes;          /* ... in so many checks in a row */
    double slope;        /* by how much the calibrated logit falls when the samples double; for predictions; 0: not known */
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
/* Samples at which p is expected to fall below `threshold`, from p at spp; at least spp. NaN if the slope is not known. */
double ggn_policy_predict(const struct ggn_policy *policy, double p, double threshold, double spp);

/* What the model says, defaults elsewhere. BASE_EINVAL when a field is out of range. */
int ggn_policy_of(const struct ggn_model *model, struct ggn_policy *policy, struct base_err *err);
/* Puts the policy into the model; its levels as "levels" where it has any. */
int ggn_policy_set(struct ggn_model *model, const struct ggn_policy *policy, struct base_err *err);

/* A whole policy as members of a JSON object, for models that are no networks. */
void ggn_policy_print(struct cJSON *to, const struct ggn_policy *policy, int *failed);
/* BASE_EINVAL when a field is no number or out of range; fields that are missing keep their default. */
int ggn_policy_parse(const struct cJSON *from, struct ggn_policy *policy, struct base_err *err);

#endif
