#include "render/json.h"

#include <math.h>
#include <stdio.h>

#include "base/fio.h"

/* Owns item from here on. Returns it, or NULL when it could not be added. */
static cJSON *add(cJSON *to, const char *key, cJSON *item, int *failed)
{
    if (item != NULL && (key != NULL ? cJSON_AddItemToObject(to, key, item) : cJSON_AddItemToArray(to, item)))
        return item;
    cJSON_Delete(item);
    *failed = 1;
    return NULL;
}

void pt_json_number(cJSON *to, const char *key, double value, int *failed)
{
    add(to, key, isfinite(value) ? cJSON_CreateNumber(value) : cJSON_CreateNull(), failed);
}

void pt_json_text(cJSON *to, const char *key, const char *text, int *failed)
{
    add(to, key, text != NULL ? cJSON_CreateString(text) : cJSON_CreateNull(), failed);
}

void pt_json_bool(cJSON *to, const char *key, int value, int *failed)
{
    add(to, key, cJSON_CreateBool(value), failed);
}

cJSON *pt_json_object(cJSON *to, const char *key, int *failed)
{
    return add(to, key, cJSON_CreateObject(), failed);
}

cJSON *pt_json_array(cJSON *to, const char *key, int *failed)
{
    return add(to, key, cJSON_CreateArray(), failed);
}

int pt_json_write(const char *path, const cJSON *root, int failed, struct pt_err *err)
{
    struct pt_fio_out out;
    char *text = failed ? NULL : cJSON_Print(root);
    if (text == NULL)
        return pt_fail_nomem(err, path);
    int rc = pt_fio_begin(&out, path, err);
    if (rc == PT_OK) {
        fprintf(out.file, "%s\n", text);
        rc = pt_fio_commit(&out, err);
    }
    cJSON_free(text);
    return rc;
}
