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

struct cJSON;

struct ggn_calibration {
    /* p = sigmoid(scale·logit + shift); 1 and 0 = not calibrated (Platt 1999). A residual model's logit is in octaves of
     * noise over what is just visible: log2 of the law's error and the network's correction */
    double scale, shift;
    double threshold; /* a check votes for stopping when p < threshold; in (0, 1) */
    int consecutive;  /* checks in a row that must vote so; 1..16 */
    double spacing;   /* ratio of spp between consecutive images the model was trained on; 1..16 */
};

struct ggn_description {
    struct ggn_hyper hyper;
    struct ggn_calibration calibration;
    struct cJSON *provenance; /* parse: the caller's to delete; print: borrows */
};

int ggn_description_parse(const char *json, struct ggn_description *out, struct base_err *err);
/* malloc'ed text, NULL without memory. */
char *ggn_description_print(const struct ggn_description *description);

#endif
