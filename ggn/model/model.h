/*
 * A trained criterion: the three networks, their hyper-parameters, the calibration of the probability, and where it all
 * comes from. Stored as a .ggn file (model/container.h) with the tensors NETWORK/STAGE.INDEX.weight|bias|mean|var, NETWORK =
 * denoiser, generator, discriminator, and a description, one JSON object:
 *
 *   {"kind": "model", "preset": "paper"|"lull", "height", "width", "window", "k_r", "k_m", "k_d",
 *    "calibration": {"scale", "shift", "threshold", "consecutive", "spacing"}, "provenance": {...}}
 *
 * and "picture": 1 in a model that takes the noise map. A residual model has "residual", the octaves of noise by which its
 * network may correct the law of visible noise, and "scalars", how many numbers the network is given (sight/measure.h).
 *
 * Read-only after loading: any number of threads and criteria may share one model.
 */
#ifndef GGN_MODEL_MODEL_H
#define GGN_MODEL_MODEL_H

#include "model/container.h"
#include "model/networks.h"
#include "model/policy.h"
#include "nn/weights.h"

struct ggn_model {
    struct ggn_hyper hyper;
    struct ggn_policy policy; /* as ggn_description has it; ggn_policy_of tells the whole */
    struct ggn_graph graph[GGN_NETS];
    struct ggn_weights *weights[GGN_NETS]; /* owns */
    struct cJSON *provenance;              /* owns; a JSON object: data-set hash, code version, seed, metrics … */
};

struct ggn_description {
    struct ggn_hyper hyper;
    struct ggn_policy policy; /* "calibration": scale, shift, threshold, passes, ratio; the rest is default */
    struct cJSON *provenance; /* parse: the caller's to delete; print: borrows */
};
int ggn_description_parse(const char *json, struct ggn_description *out, struct base_err *err);
/* malloc'ed text, NULL without memory. */
char *ggn_description_print(const struct ggn_description *description);

/* A model with zero weights. NULL on failure. */
struct ggn_model *ggn_model_create(const struct ggn_hyper *hyper, struct base_err *err);
void ggn_model_destroy(struct ggn_model *model);

/* BASE_EINVAL with one line that names the file for anything that is not a model this program can run. */
int ggn_model_load(const char *path, struct ggn_model **model, struct base_err *err);
/* The same of a file that was read already; `name` is for messages. */
int ggn_model_parse(const struct ggn_container *c, const char *name, struct ggn_model **model, struct base_err *err);
/* Atomic. `type` is that of the convolution and linear weights; biases, batch norm and statistics are always f32. */
int ggn_model_save(const struct ggn_model *model, const char *path, enum ggn_type type, struct base_err *err);

/* What the model says, defaults elsewhere. BASE_EINVAL when a field is out of range. */
int ggn_policy_of(const struct ggn_model *model, struct ggn_policy *policy, struct base_err *err);
/* Puts the policy into the model; its levels as "levels" where it has any. */
int ggn_policy_set(struct ggn_model *model, const struct ggn_policy *policy, struct base_err *err);

#endif
