#include "data/labels.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "base/list.h"

enum { MAX_TEXT = 1 << 26, MAX_LABELS = 1 << 20 };

void ggn_labels_release(struct ggn_labels *labels)
{
    free(labels->labels);
    *labels = (struct ggn_labels){0};
}

const struct ggn_label *ggn_labels_find(const struct ggn_labels *labels, uint32_t id)
{
    for (uint32_t i = 0; i < labels->n; i++)
        if (labels->labels[i].id == id)
            return &labels->labels[i];
    return NULL;
}

int ggn_label_noisy(const struct ggn_label *label, double spp)
{
    if (label->censored && spp >= label->threshold)
        return -1;
    return spp < label->threshold;
}

double ggn_label_p_noisy(const struct ggn_label *label, double spp, double spread)
{
    if (ggn_label_noisy(label, spp) < 0)
        return (double)NAN;
    double p = 0.5 * erfc(log2(spp / label->threshold) / (spread * sqrt(2.0)));
    return label->censored ? 0.5 + 0.5 * p : p; /* the true threshold lies at the cap or above it */
}

static int get_positive(const cJSON *o, const char *name, double *out)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(o, name);
    if (!cJSON_IsNumber(v) || !(v->valuedouble > 0.0 && v->valuedouble < 1e12))
        return 0;
    *out = v->valuedouble;
    return 1;
}

static int parse_entries(const char *path, const cJSON *blocks, struct ggn_labels *l, struct base_err *err)
{
    int n = cJSON_GetArraySize(blocks);
    const cJSON *v;
    if (!cJSON_IsArray(blocks) || n < 1 || n > MAX_LABELS)
        return base_fail(err, BASE_EINVAL, "%s: no list of blocks", path);
    l->labels = malloc((size_t)n * sizeof *l->labels);
    if (!l->labels)
        return base_fail_nomem(err, path);
    cJSON_ArrayForEach (v, blocks) {
        const cJSON *id = cJSON_GetObjectItemCaseSensitive(v, "id");
        struct ggn_label *label = &l->labels[l->n];
        if (!cJSON_IsNumber(id) || !(id->valuedouble >= 0 && id->valuedouble < UINT32_MAX) ||
            !get_positive(v, "threshold", &label->threshold))
            return base_fail(err, BASE_EINVAL, "%s: entry %u of blocks has no id or no threshold", path, l->n);
        label->id = (uint32_t)id->valuedouble;
        label->censored = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(v, "censored"));
        l->n++;
    }
    uint32_t twice;
    int rc = base_unique_numbers(&l->labels->id, sizeof *l->labels, l->n, &twice);
    if (rc > 0)
        return base_fail(err, BASE_EINVAL, "%s: block %u is labelled twice", path, twice);
    return rc ? base_fail_nomem(err, path) : 0;
}

int ggn_labels_parse(const char *path, const char *text, size_t size, struct ggn_labels *out, struct base_err *err)
{
    struct ggn_labels l = {0};
    cJSON *root = cJSON_ParseWithLength(text, size);
    const cJSON *format = cJSON_GetObjectItemCaseSensitive(root, "format"),
                *source = cJSON_GetObjectItemCaseSensitive(root, "source");
    const cJSON *detail = cJSON_GetObjectItemCaseSensitive(root, "detail");
    int rc;
    if (!cJSON_IsString(format) || strcmp(format->valuestring, "lull-labels") != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: not a file of labels", path);
    else if (!cJSON_IsString(source) ||
             (strcmp(source->valuestring, "human") != 0 && strcmp(source->valuestring, "observer") != 0))
        rc = base_fail(err, BASE_EINVAL, "%s: source must be \"human\" or \"observer\"", path);
    else if (!get_positive(root, "cap", &l.cap) || !get_positive(root, "spread", &l.spread))
        rc = base_fail(err, BASE_EINVAL, "%s: cap or spread is missing", path);
    else
        rc = parse_entries(path, cJSON_GetObjectItemCaseSensitive(root, "blocks"), &l, err);
    if (!rc) {
        snprintf(l.source, sizeof l.source, "%s", source->valuestring);
        snprintf(l.detail, sizeof l.detail, "%s", cJSON_IsString(detail) ? detail->valuestring : "");
        *out = l;
    } else {
        ggn_labels_release(&l);
    }
    cJSON_Delete(root);
    return rc;
}

int ggn_labels_read(const char *dir, struct ggn_labels *labels, struct base_err *err)
{
    char path[4096], *text;
    size_t size;
    int rc = base_file_join(path, dir, "labels.json", err);
    if (!rc)
        rc = base_file_read(path, MAX_TEXT, &text, &size, err);
    if (rc)
        return rc;
    rc = ggn_labels_parse(path, text, size, labels, err);
    free(text);
    return rc;
}

/* The same as cJSON keeps it: of numbers that agree to DBL_EPSILON it may write one for the other. */
static int is_stored_as(double a, double b) { return fabs(a - b) <= DBL_EPSILON * fmax(a, b); }

static int is_same(const struct ggn_labels *a, const struct ggn_labels *b)
{
    int same = strcmp(a->source, b->source) == 0 && a->n == b->n;
    for (uint32_t i = 0; i < a->n && same; i++) {
        const struct ggn_label *l = ggn_labels_find(b, a->labels[i].id);
        same = l && is_stored_as(a->labels[i].threshold, l->threshold) && l->censored == a->labels[i].censored;
    }
    return same;
}

int ggn_labels_keep_people(const char *dir, const struct ggn_labels *next, struct base_err *err)
{
    struct ggn_labels old;
    char path[4096];
    int rc = base_file_join(path, dir, "labels.json", err);
    if (rc || access(path, F_OK) != 0)
        return rc;
    rc = ggn_labels_read(dir, &old, err);
    if (rc)
        return rc;
    if (strcmp(old.source, "human") == 0 && !(next && is_same(&old, next)))
        rc = base_fail(err, BASE_EINVAL, "%s: thresholds of people would be lost; ggn label --replace-human replaces them",
                       path);
    ggn_labels_release(&old);
    return rc;
}

int ggn_labels_write(const char *dir, const struct ggn_labels *labels, int replace_human, struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, dir, "labels.json", err);
    if (!rc && !replace_human)
        rc = ggn_labels_keep_people(dir, labels, err);
    if (rc)
        return rc;
    int failed = 0;
    cJSON *root = cJSON_CreateObject();
    base_json_text(root, "format", "lull-labels", &failed);
    base_json_number(root, "version", 1, &failed);
    base_json_text(root, "source", labels->source, &failed);
    base_json_text(root, "detail", labels->detail, &failed);
    base_json_number(root, "cap", labels->cap, &failed);
    base_json_number(root, "spread", labels->spread, &failed);
    cJSON *blocks = base_json_array(root, "blocks", &failed);
    for (uint32_t i = 0; i < labels->n; i++) {
        cJSON *o = base_json_object(blocks, NULL, &failed);
        base_json_number(o, "id", labels->labels[i].id, &failed);
        base_json_number(o, "threshold", labels->labels[i].threshold, &failed);
        base_json_bool(o, "censored", labels->labels[i].censored, &failed);
    }
    rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}
