#include "base/json.h"

#include <math.h>
#include <stdio.h>

#include "base/files.h"
#include "base/text.h"

/* Owns item from here on. Returns it, or NULL when it could not be added. */
static cJSON *add(cJSON *to, const char *key, cJSON *item, int *failed)
{
    if (item && (key ? cJSON_AddItemToObject(to, key, item) : cJSON_AddItemToArray(to, item)))
        return item;
    cJSON_Delete(item);
    *failed = 1;
    return NULL;
}

void base_json_number(cJSON *to, const char *key, double value, int *failed)
{
    add(to, key, isfinite(value) ? cJSON_CreateNumber(value) : cJSON_CreateNull(), failed);
}

void base_json_text(cJSON *to, const char *key, const char *text, int *failed)
{
    cJSON *item = text ? cJSON_CreateString(text) : cJSON_CreateNull();
    if (item && text)
        base_utf8_mend(item->valuestring);
    add(to, key, item, failed);
}

void base_json_bool(cJSON *to, const char *key, int value, int *failed) { add(to, key, cJSON_CreateBool(value), failed); }

cJSON *base_json_object(cJSON *to, const char *key, int *failed) { return add(to, key, cJSON_CreateObject(), failed); }

cJSON *base_json_array(cJSON *to, const char *key, int *failed) { return add(to, key, cJSON_CreateArray(), failed); }

void base_json_numbers(cJSON *to, const char *key, const double *values, int count, int *failed)
{
    cJSON *list = base_json_array(to, key, failed);
    for (int i = 0; i < count; i++)
        base_json_number(list, NULL, values[i], failed);
}

void base_json_item(cJSON *to, const char *key, cJSON *item, int *failed) { add(to, key, item, failed); }

int base_json_write(const char *path, const cJSON *root, int failed, struct base_err *err)
{
    char *text = failed ? NULL : cJSON_Print(root);
    int rc = !text ? base_fail_nomem(err, path ? path : "JSON") : path ? base_file_write_line(path, text, err) : 0;
    if (!rc && !path)
        puts(text);
    cJSON_free(text);
    return rc;
}

int base_json_get(const cJSON *object, const char *key, double lo, double hi, double *out)
{
    const cJSON *v = cJSON_GetObjectItemCaseSensitive(object, key);
    if (!cJSON_IsNumber(v) || !(v->valuedouble >= lo && v->valuedouble <= hi))
        return 0;
    *out = v->valuedouble;
    return 1;
}

int base_json_get_whole(const cJSON *object, const char *key, double lo, double hi, uint64_t *out)
{
    double value;
    if (!base_json_get(object, key, lo, hi, &value) || floor(value) != value)
        return 0;
    *out = value < 0x1p64 ? (uint64_t)value : UINT64_MAX;
    return 1;
}

int base_json_need(const cJSON *object, const char *key, double lo, double hi, double *out, struct base_err *err)
{
    return base_json_get(object, key, lo, hi, out)
               ? 0
               : base_fail(err, BASE_EINVAL, "'%s' is missing or not a number in %g..%g", key, lo, hi);
}

int base_json_need_int(const cJSON *object, const char *key, int lo, int hi, int *out, struct base_err *err)
{
    double value = 0;
    int rc = base_json_need(object, key, lo, hi, &value, err);
    if (!rc && value != floor(value))
        rc = base_fail(err, BASE_EINVAL, "'%s' is not a whole number", key);
    if (!rc)
        *out = (int)value;
    return rc;
}
