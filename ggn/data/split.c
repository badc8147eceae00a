#include "data/split.h"

#include <cjson/cJSON.h>
#include <string.h>

const char *const ggn_split_sources[GGN_SPLIT_SOURCES] = {"the data set's own", "the models' own", "every fifth scene"};

static int is_item(const char *list, const char *scene)
{
    const size_t length = strlen(scene);

    for (size_t n; *list; list += n + (list[n] == ',')) {
        n = strcspn(list, ",");
        if (n == length && !memcmp(list, scene, n))
            return 1;
    }
    return 0;
}

/* What somebody who wrote a folder's name should have written. */
static int no_scene(const struct ggn_dataset *data, const char *option, const char *name, int length, struct base_err *err)
{
    for (int i = 0; i < data->n; i++)
        if (strlen(data->views[i].name) == (size_t)length && !memcmp(data->views[i].name, name, (size_t)length))
            return base_fail(err, BASE_EINVAL, "%s: no scene '%.*s' in the data: this folder's scene is '%s'", option,
                             length, name, data->views[i].manifest.scene);
    return base_fail(err, BASE_EINVAL, "%s: no scene '%.*s' in the data", option, length < 200 ? length : 200, name);
}

static int apply_list(struct ggn_dataset *data, const char *option, const char *list, enum ggn_split split,
                      struct base_err *err)
{
    for (size_t n; *list; list += n + (list[n] == ',')) {
        int found = 0;
        n = strcspn(list, ",");
        for (int i = 0; i < data->n; i++) {
            const char *scene = data->views[i].manifest.scene;
            if (strlen(scene) != n || memcmp(scene, list, n) != 0)
                continue;
            data->views[i].split = split;
            found = 1;
        }
        if (!found)
            return no_scene(data, option, list, (int)(n < 4096 ? n : 4096), err);
    }
    return 0;
}

static int check_lists(const struct ggn_dataset *data, const struct ggn_split_options *o, struct base_err *err)
{
    for (int i = 0; i < data->n && o->validation && o->test; i++)
        if (is_item(o->validation, data->views[i].manifest.scene) && is_item(o->test, data->views[i].manifest.scene))
            return base_fail(err, BASE_EINVAL, "--validation and --test: both list the scene '%s'",
                             data->views[i].manifest.scene);
    return 0;
}

enum ggn_split ggn_split_learned(const cJSON *learned, const char *scene)
{
    for (int split = 0; split < GGN_SPLIT_NONE; split++) {
        const cJSON *item;
        cJSON_ArrayForEach (item, cJSON_GetObjectItemCaseSensitive(learned, ggn_split_names[split]))
            if (cJSON_IsString(item) && !strcmp(item->valuestring, scene))
                return (enum ggn_split)split;
    }
    return GGN_SPLIT_NONE;
}

/* The side nearest to training of all models. */
static enum ggn_split by_models(const struct ggn_split_options *o, const char *scene)
{
    enum ggn_split split = GGN_SPLIT_TEST;

    for (int i = 0; i < o->n_learned; i++) {
        enum ggn_split own = ggn_split_learned(o->learned[i], scene);
        split = own < split ? own : split;
    }
    return split;
}

static enum ggn_split_source source_of(const struct ggn_dataset *data, const struct ggn_split_options *o)
{
    for (int i = 0; i < data->n; i++)
        if (data->views[i].split != GGN_SPLIT_NONE)
            return GGN_SPLIT_BY_DATA;
    for (int i = 0; i < o->n_learned; i++)
        if (cJSON_GetArraySize(cJSON_GetObjectItemCaseSensitive(o->learned[i], ggn_split_names[GGN_SPLIT_TRAIN])) > 0)
            return GGN_SPLIT_BY_MODELS;
    return GGN_SPLIT_BY_FIFTHS;
}

int ggn_split_choose(struct ggn_dataset *data, const struct ggn_split_options *o, enum ggn_split_source *source,
                     struct base_err *err)
{
    const int fifth = data->n_scenes < 3 ? 1 : 2;
    int rc = check_lists(data, o, err);

    if (rc)
        return rc;
    *source = source_of(data, o);
    for (int i = 0; i < data->n && *source != GGN_SPLIT_BY_DATA; i++) {
        struct ggn_dataset_view *v = &data->views[i];
        if (*source == GGN_SPLIT_BY_MODELS)
            v->split = by_models(o, v->manifest.scene);
        else
            v->split = v->scene % 5 == fifth && !o->validation ? GGN_SPLIT_VALIDATION : GGN_SPLIT_TRAIN;
    }
    if (o->validation)
        rc = apply_list(data, "--validation", o->validation, GGN_SPLIT_VALIDATION, err);
    return !rc && o->test ? apply_list(data, "--test", o->test, GGN_SPLIT_TEST, err) : rc;
}
