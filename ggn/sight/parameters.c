/* The observer's parameters as text and from files; apart from the rest, so that the criterion needs no JSON library. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "sight/observer.h"
#include "sight/view_name.h"

void ggn_observer_describe(const struct ggn_observer *o, char *text, size_t room)
{
    snprintf(text, room, "model observer: noise in L* is seen above %.4f sqrt(texture + 2) of a patch, spread %.2f octaves",
             o->level, o->spread);
}

/* What was fitted without this view; root where it had no part in the fit. */
static const cJSON *fit_without(const cJSON *root, const char *left_out)
{
    const cJSON *row;
    cJSON_ArrayForEach (row, cJSON_GetObjectItemCaseSensitive(root, "each_view_left_out")) {
        const cJSON *name = cJSON_GetObjectItemCaseSensitive(row, "name");
        if (left_out && cJSON_IsString(name) && ggn_view_is(name->valuestring, left_out))
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
    if (!base_json_get(from, "level", 1e-6, 1e3, &o.level) || !base_json_get(root, "spread", 1e-3, 10, &o.spread))
        rc = base_fail(err, BASE_EINVAL,
                       "%s: level or spread is missing or out of range (ggn label --calibrate writes them)", path);
    else if (cJSON_HasObjectItem(root, "exponent"))
        rc = base_fail(err, BASE_EINVAL,
                       "%s: an observer with two fitted numbers, of an earlier version: "
                       "write it anew with ggn label --calibrate",
                       path);
    else
        *out = o;
    cJSON_Delete(root);
    free(text);
    return rc;
}
