/*
 * What a model file says about its networks, as one JSON object:
 *
 *   {"kind": "model", "preset": "paper"|"lull", "height", "width", "window", "k_r", "k_m", "k_d",
 *    "calibration": {"scale", "shift", "threshold", "consecutive", "spacing"}, "provenance": {...}}
 *
 * and "picture": 1 in a model that takes the noise map. A residual model has "residual", the octaves of noise by which its
 * network may correct the law of visible noise, and "scalars", how many numbers the network is given (model/measure.h).
 */
#ifndef GGN_MODEL_DESCRIPTION_H
#define GGN_MODEL_DESCRIPTION_H

#include "model/networks.h"
#include "model/policy.h"

struct ggn_description {
    struct ggn_hyper hyper;
    struct ggn_policy policy; /* "calibration": scale, shift, threshold, passes, ratio; the rest is default */
    struct cJSON *provenance; /* parse: the caller's to delete; print: borrows */
};

int ggn_description_parse(const char *json, struct ggn_description *out, struct base_err *err);
/* malloc'ed text, NULL without memory. */
char *ggn_description_print(const struct ggn_description *description);

#endif
