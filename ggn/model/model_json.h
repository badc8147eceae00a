/* The JSON object of a model file, see model/model.h. Private to ggn/model. */
#ifndef GGN_MODEL_MODEL_JSON_H
#define GGN_MODEL_MODEL_JSON_H

#include "model/model.h"

struct ggn_model_description {
    struct ggn_hyper hyper;
    struct ggn_calibration calibration;
    struct cJSON *provenance; /* caller owns */
};

int ggn_model_json_parse(const char *json, struct ggn_model_description *out, struct base_err *err);
/* malloc'ed text, NULL without memory. */
char *ggn_model_json_print(const struct ggn_model *model);

#endif
