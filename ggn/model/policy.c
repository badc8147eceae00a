#include "model/policy.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/json.h"
#include "nn/loss.h"

/* Every field with its range but passes, which is an integer. `own`: a model's calibration has no place for it. */
static const struct {
    const char *name;
    size_t offset;
    double min, max;
    int own;
} fields[] = {
    {"first_spp", offsetof(struct ggn_policy, first_spp), 1, 1e9, 1},
    {"ratio", offsetof(struct ggn_policy, ratio), 0, 100, 1},
    {"step_spp", offsetof(struct ggn_policy, step_spp), 0, 1e9, 1},
    {"scale", offsetof(struct ggn_policy, scale), 1e-6, 1e6, 0},
    {"shift", offsetof(struct ggn_policy, shift), -1e6, 1e6, 0},
    {"threshold", offsetof(struct ggn_policy, threshold), 0, 1, 0},
    {"slope", offsetof(struct ggn_policy, slope), 0, 1e6, 1},
};
enum { N_FIELDS = sizeof fields / sizeof fields[0], PASSES_MAX = 16 };

static double get(const struct ggn_policy *p, int i)
{
    double v;
    memcpy(&v, (const char *)p + fields[i].offset, sizeof v);
    return v;
}

struct ggn_policy ggn_policy_default(void)
{
    return (struct ggn_policy){.first_spp = 20, .ratio = 1.15, .scale = 1, .threshold = 0.5, .passes = 1};
}

int ggn_policy_check(const struct ggn_policy *p, struct base_err *err)
{
    for (int i = 0; i < N_FIELDS; i++) {
        double v = get(p, i);
        if (!(v >= fields[i].min && v <= fields[i].max))
            return base_fail(err, BASE_EINVAL, "policy: %s = %g is not in %g..%g", fields[i].name, v, fields[i].min,
                             fields[i].max);
    }
    if (p->passes < 1 || p->passes > PASSES_MAX)
        return base_fail(err, BASE_EINVAL, "policy: passes = %d is not in 1..%d", p->passes, PASSES_MAX);
    if (p->n_levels < 0 || p->n_levels > GGN_POLICY_LEVELS)
        return base_fail(err, BASE_EINVAL, "policy: %d levels are not in 0..%d", p->n_levels, GGN_POLICY_LEVELS);
    for (int i = 0; i < p->n_levels; i++)
        if (!(p->level[i] >= (i ? p->level[i - 1] + 1 : 1) && p->level[i] <= 1e9))
            return base_fail(err, BASE_EINVAL, "policy: level %d, %g samples, does not follow", i, p->level[i]);
    if (p->ratio <= 1.001 && p->step_spp < 1)
        return base_fail(err, BASE_EINVAL, "policy: neither a ratio above 1 nor a step says how levels are spaced");
    return 0;
}

int ggn_policy_adjust(struct ggn_policy *p, const char *name, double value)
{
    if (!strcmp(name, "visible"))
        p->threshold = value;
    else if (!strcmp(name, "first-spp"))
        p->first_spp = value;
    else if (!strcmp(name, "passes"))
        p->passes = (int)value;
    else
        return 0;
    return 1;
}

double ggn_policy_p(const struct ggn_policy *p, double logit)
{
    /* an error costs time, never quality */
    return isfinite(logit) ? ggn_sigmoid(p->scale * logit + p->shift) : 1;
}

double ggn_policy_next(const struct ggn_policy *p, double spp)
{
    for (int i = 0; i < p->n_levels; i++)
        if (p->level[i] > spp)
            return fmax(p->level[i], spp + 1);
    double next = p->ratio > 1.001 ? floor(spp * p->ratio + 0.5) : spp + p->step_spp;

    return fmax(next, spp + 1);
}

/* A quarter of a step, or the sample that rounding to whole ones moves a level. */
static int follows(const struct ggn_policy *p, double from, double to)
{
    return fabs(ggn_policy_next(p, from) - to) <= fmax(0.25 * (to - from), 1);
}

void ggn_policy_set_levels(struct ggn_policy *p, const double *spp, int n)
{
    p->n_levels = 0;
    n -= n > 1 && !follows(p, spp[n - 2], spp[n - 1]); /* a recording ends where it was told to */
    while (n > 1 && follows(p, spp[n - 2], spp[n - 1]))
        n--;
    p->n_levels = n < 2 ? 0 : n < GGN_POLICY_LEVELS ? n : GGN_POLICY_LEVELS;
    for (int i = 0; i < p->n_levels; i++)
        p->level[i] = spp[i];
}

int ggn_policy_levels_differ(const struct ggn_policy *policy, const double *spp, int n, double *asked, double *nearest)
{
    int i = 0, differ = 0;
    while (i < n && spp[i] < policy->first_spp)
        i++;
    while (i + 1 < n) {
        const double next = ggn_policy_next(policy, spp[i]), step = next - spp[i];
        int k = i + 1;
        while (k + 1 < n && fabs(spp[k + 1] - next) <= fabs(spp[k] - next))
            k++;
        if (next < spp[n - 1] && fabs(spp[k] - next) >= fmax(0.5 * step, 1 + 1e-9) && differ++ == 0) {
            *asked = next;
            *nearest = spp[k];
        }
        i = k;
    }
    return differ > 1;
}

size_t ggn_setting_difference(const struct ggn_setting *learned, const struct ggn_setting *here, char *text, size_t room)
{
    static const char *const transfers[] = {"sRGB", "a gamma", "linear codes"};
    size_t used = 0;
    text[0] = '\0';
    if (here->width != learned->width || here->height != learned->height)
        used = (size_t)snprintf(text, room, "blocks of %dx%d pixels instead of %dx%d", here->width, here->height,
                                learned->width, learned->height);
    if (here->transfer != learned->transfer && used < room)
        used += (size_t)snprintf(text + used, room - used, "%s%s instead of %s", used ? ", " : "", transfers[here->transfer],
                                 transfers[learned->transfer]);
    return used < room ? used : room - 1;
}

double ggn_policy_predict(const struct ggn_policy *policy, double p, double threshold, double spp)
{
    if (!(policy->slope > 0) || !(p >= 0))
        return (double)NAN;
    double clamped = fmin(fmax(p, 1e-6), 1 - 1e-6), t = fmin(fmax(threshold, 1e-6), 1 - 1e-6);
    double above = log(clamped / (1 - clamped)) - log(t / (1 - t));
    return above > 0 ? spp * exp2(fmin(above / policy->slope, 20)) : spp;
}

void ggn_policy_put(cJSON *to, const struct ggn_policy *policy, int only_own, int *failed)
{
    for (int i = 0; i < N_FIELDS; i++)
        if (fields[i].own || !only_own)
            base_json_number(to, fields[i].name, get(policy, i), failed);
    cJSON *levels = policy->n_levels ? base_json_array(to, "levels", failed) : NULL;
    for (int i = 0; i < policy->n_levels; i++)
        base_json_number(levels, NULL, policy->level[i], failed);
}

static int get_levels(const cJSON *list, struct ggn_policy *policy, struct base_err *err)
{
    const cJSON *item;
    if (list && (!cJSON_IsArray(list) || cJSON_GetArraySize(list) > GGN_POLICY_LEVELS))
        return base_fail(err, BASE_EINVAL, "policy: levels: expected a list of at most %d numbers", GGN_POLICY_LEVELS);
    cJSON_ArrayForEach (item, list) {
        if (!cJSON_IsNumber(item))
            return base_fail(err, BASE_EINVAL, "policy: levels: expected numbers");
        policy->level[policy->n_levels++] = item->valuedouble;
    }
    return 0;
}

int ggn_policy_get(const cJSON *from, struct ggn_policy p, int only_own, struct ggn_policy *policy, struct base_err *err)
{
    for (int i = 0; i < N_FIELDS; i++) {
        const cJSON *item = fields[i].own || !only_own ? cJSON_GetObjectItemCaseSensitive(from, fields[i].name) : NULL;
        if (item && !cJSON_IsNumber(item))
            return base_fail(err, BASE_EINVAL, "policy: %s is not a number", fields[i].name);
        if (item)
            memcpy((char *)&p + fields[i].offset, &item->valuedouble, sizeof item->valuedouble);
    }
    int rc = get_levels(cJSON_GetObjectItemCaseSensitive(from, "levels"), &p, err);
    if (!rc)
        rc = ggn_policy_check(&p, err);
    if (!rc)
        *policy = p;
    return rc;
}

void ggn_policy_print(cJSON *to, const struct ggn_policy *policy, int *failed)
{
    ggn_policy_put(to, policy, 0, failed);
    base_json_number(to, "passes", policy->passes, failed);
}

int ggn_policy_parse(const cJSON *from, struct ggn_policy *policy, struct base_err *err)
{
    struct ggn_policy p = ggn_policy_default();
    const cJSON *passes = cJSON_GetObjectItemCaseSensitive(from, "passes");
    p.passes = cJSON_IsNumber(passes) ? passes->valueint : 0;
    return ggn_policy_get(from, p, 0, policy, err);
}
