#include "observer/observer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"

static const double STUDY_REFERENCE = 20000.0; /* R */

const struct ggn_observer ggn_observer_default = {.level = 0.256801, .spread = 0.465799};

static double min(double a, double b)
{
    return a < b ? a : b;
}

double ggn_observer_from_study(double spp)
{
    return spp >= GGN_STUDY_CAP ? GGN_LABELS_CAP : 1.0 / (1.0 / spp - 1.0 / STUDY_REFERENCE);
}

double ggn_observer_to_study(double spp)
{
    return min(1.0 / (1.0 / spp + 1.0 / STUDY_REFERENCE), GGN_STUDY_CAP);
}

/* Standard error of the pooled Gaussian noise of P pixels is this over sqrt(P), as a share of it: a sixth moment scatters by
 * sqrt(10170)/15, its root by a sixth of that, and the blur leaves about a third of the pixels independent. */
static const double POOLING_ERROR = 1.94;

double ggn_observer_error(const struct ggn_observer *o, double visible, size_t pixels)
{
    return (1.0 + POOLING_ERROR / sqrt((double)pixels)) * visible / o->level;
}

double ggn_observer_next(double spp, double predicted, double growth)
{
    return fmin(fmax(predicted, 1.04 * spp), growth * spp);
}

double ggn_observer_p_noisy(const struct ggn_observer *o, double error)
{
    return error > 0.0 ? 0.5 * erfc(-2.0 * log2(error) / (o->spread * sqrt(2.0))) : 0.0;
}

double ggn_observer_error_at(const struct ggn_observer *o, double share)
{
    double below = 1e-6, above = 1e6; /* errors; bisected in octaves */
    for (int i = 0; i < 60; i++) {
        double middle = sqrt(below * above);
        if (ggn_observer_p_noisy(o, middle) < share)
            below = middle;
        else
            above = middle;
    }
    return sqrt(below * above);
}

void ggn_observer_describe(const struct ggn_observer *o, char *text, size_t room)
{
    snprintf(text, room, "model observer: noise in L* is seen above %.4f sqrt(texture + 2) of a patch, spread %.2f octaves",
             o->level, o->spread);
}

static int get(const cJSON *root, const char *name, double lo, double hi, double *out)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(root, name);
    if (!cJSON_IsNumber(v) || !(v->valuedouble >= lo && v->valuedouble <= hi))
        return 0;
    *out = v->valuedouble;
    return 1;
}

/* What was fitted without this view; root where it had no part in the fit. */
static const cJSON *fit_without(const cJSON *root, const char *left_out)
{
    const cJSON *row;
    cJSON_ArrayForEach(row, cJSON_GetObjectItemCaseSensitive(root, "each_view_left_out")) {
        const cJSON *name = cJSON_GetObjectItemCaseSensitive(row, "name");
        if (left_out && cJSON_IsString(name) && strcmp(name->valuestring, left_out) == 0)
            return row;
    }
    return root;
}

int ggn_observer_read(const char *path, const char *left_out, struct ggn_observer *out, struct base_err *err)
{
    struct ggn_observer o;
    char *text;
    size_t size;
    int rc = base_file_read(path, 1 << 24, &text, &size, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_ParseWithLength(text, size);
    const cJSON *from = fit_without(root, left_out);
    if (!get(from, "level", 1e-6, 1e3, &o.level) || !get(root, "spread", 1e-3, 10, &o.spread))
        rc = base_fail(err, BASE_EINVAL,
                       "%s: level or spread is missing or out of range (ggn label --calibrate writes them)", path);
    else if (cJSON_HasObjectItem(root, "exponent"))
        rc = base_fail(err, BASE_EINVAL,
                       "%s: an observer with two fitted numbers, of an earlier version: "
                       "write it anew with ggn label --calibrate", path);
    else
        *out = o;
    cJSON_Delete(root);
    free(text);
    return rc;
}
