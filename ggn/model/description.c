/* The description in a model file. */
#include <cjson/cJSON.h>
#include <stddef.h>
#include <string.h>

#include "base/json.h"
#include "base/options.h"
#include "sight/measure.h"
#include "model/model.h"

/* Hyper-parameters and calibration as tables, so that reading and writing cannot disagree. spacing: 1 where levels are not
 * told by a ratio. */
static const struct {
    const char *name;
    size_t at;
} hyper_field[] = {{"height", offsetof(struct ggn_hyper, height)}, {"width", offsetof(struct ggn_hyper, width)},
                   {"window", offsetof(struct ggn_hyper, window)}, {"k_r", offsetof(struct ggn_hyper, k_r)},
                   {"k_m", offsetof(struct ggn_hyper, k_m)},       {"k_d", offsetof(struct ggn_hyper, k_d)}};

static const struct {
    const char *name;
    size_t at;
    double min, max;
} calibration_field[] = {{"scale", offsetof(struct ggn_policy, scale), -1e6, 1e6},
                         {"shift", offsetof(struct ggn_policy, shift), -1e6, 1e6},
                         {"threshold", offsetof(struct ggn_policy, threshold), 0, 1},
                         {"spacing", offsetof(struct ggn_policy, ratio), 1, 16}};

enum {
    N_HYPER = sizeof hyper_field / sizeof hyper_field[0],
    N_CALIBRATION = sizeof calibration_field / sizeof calibration_field[0]
};

static int parse_root(const cJSON *root, struct ggn_description *d, struct base_err *err)
{
    const cJSON *kind = cJSON_GetObjectItemCaseSensitive(root, "kind");
    const cJSON *preset = cJSON_GetObjectItemCaseSensitive(root, "preset");
    const cJSON *calibration = cJSON_GetObjectItemCaseSensitive(root, "calibration");
    const char *name = cJSON_IsString(preset) ? preset->valuestring : "";
    const int index = base_word_index(ggn_preset_names, name, strlen(name));
    int rc = 0;
    if (!cJSON_IsString(kind) || strcmp(kind->valuestring, "model") != 0)
        return base_fail(err, BASE_EINVAL, "not a model (its description has no \"kind\": \"model\")");
    if (index < 0)
        return base_fail(err, BASE_EINVAL, "'preset' is neither \"paper\" nor \"lull\"");
    d->hyper.preset = (enum ggn_preset)index;
    for (size_t i = 0; i < N_HYPER && !rc; i++)
        rc = base_json_need_int(root, hyper_field[i].name, 1, 1 << 20,
                                (int *)(void *)((char *)&d->hyper + hyper_field[i].at), err);
    if (!rc && cJSON_HasObjectItem(root, "picture"))
        rc = base_json_need_int(root, "picture", 0, 1, &d->hyper.noise_map, err);
    if (!rc && cJSON_HasObjectItem(root, "residual"))
        rc = base_json_need(root, "residual", 0, GGN_REACH_MAX, &d->hyper.reach, err);
    if (!rc && cJSON_HasObjectItem(root, "scalars"))
        rc = base_json_need_int(root, "scalars", 0, GGN_SCALARS, &d->hyper.scalars, err);
    for (size_t i = 0; i < N_CALIBRATION && !rc; i++)
        rc = base_json_need(calibration, calibration_field[i].name, calibration_field[i].min, calibration_field[i].max,
                            (double *)(void *)((char *)&d->policy + calibration_field[i].at), err);
    if (!rc)
        rc = base_json_need_int(calibration, "consecutive", 1, 16, &d->policy.passes, err);
    return rc;
}

int ggn_description_parse(const char *json, struct ggn_description *out, struct base_err *err)
{
    cJSON *root = cJSON_Parse(json);
    struct ggn_description d = {.policy = ggn_policy_default()};
    if (!root)
        return base_fail(err, BASE_EINVAL, "the description is not JSON");
    int rc = parse_root(root, &d, err);
    if (!rc) {
        cJSON *provenance = cJSON_DetachItemFromObjectCaseSensitive(root, "provenance");
        if (provenance && !cJSON_IsObject(provenance)) {
            cJSON_Delete(provenance);
            rc = base_fail(err, BASE_EINVAL, "'provenance' is not an object");
        } else {
            d.provenance = provenance ? provenance : cJSON_CreateObject();
            *out = d;
        }
    }
    cJSON_Delete(root);
    return rc;
}

static cJSON *to_json(const struct ggn_description *d, int *failed)
{
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "kind", "model", failed);
    base_json_text(root, "preset", ggn_preset_names[d->hyper.preset], failed);
    for (size_t i = 0; i < N_HYPER; i++)
        base_json_number(root, hyper_field[i].name,
                         *(const int *)(const void *)((const char *)&d->hyper + hyper_field[i].at), failed);
    if (d->hyper.noise_map)
        base_json_number(root, "picture", d->hyper.noise_map, failed);
    if (d->hyper.reach > 0) {
        base_json_number(root, "residual", d->hyper.reach, failed);
        base_json_number(root, "scalars", d->hyper.scalars, failed);
    }
    cJSON *calibration = base_json_object(root, "calibration", failed);
    for (size_t i = 0; i < N_CALIBRATION; i++)
        base_json_number(calibration, calibration_field[i].name,
                         *(const double *)(const void *)((const char *)&d->policy + calibration_field[i].at), failed);
    base_json_number(calibration, "consecutive", d->policy.passes, failed);
    base_json_item(root, "provenance", cJSON_Duplicate(d->provenance, 1), failed);
    return root;
}

char *ggn_description_print(const struct ggn_description *d)
{
    int failed = 0;
    cJSON *root = to_json(d, &failed);
    char *text = failed ? NULL : cJSON_Print(root);
    cJSON_Delete(root);
    return text;
}
