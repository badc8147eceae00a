#include "data/dataset.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cjson/cJSON.h>

#include "base/files.h"

const char *const ggn_split_names[GGN_SPLITS] = {"train", "validation", "test", "people", "none"};
const char *const ggn_split_sources[GGN_SPLIT_SOURCES] = {"the data set's own", "the models' own", "every fifth scene"};

static int exists(const char *dir, const char *name)
{
    char path[8192];
    struct stat st;
    snprintf(path, sizeof path, "%s/%s", dir, name);
    return stat(path, &st) == 0;
}

void ggn_dataset_release(struct ggn_dataset *data)
{
    for (int i = 0; i < data->n; i++) {
        seq_manifest_release(&data->views[i].manifest);
        ggn_labels_release(&data->views[i].labels);
    }
    free(data->views);
    *data = (struct ggn_dataset){0};
}

static int add_view(struct ggn_dataset *d, const char *dir, struct base_err *err)
{
    struct ggn_dataset_view *views = realloc(d->views, (size_t)(d->n + 1) * sizeof *views);
    if (!views)
        return base_fail_nomem(err, dir);
    d->views = views;
    struct ggn_dataset_view *v = &views[d->n];
    *v = (struct ggn_dataset_view){.split = GGN_SPLIT_NONE};
    if (strlen(dir) >= sizeof v->dir)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
    strcpy(v->dir, dir);
    int rc = seq_manifest_read(dir, &v->manifest, err);
    if (rc)
        return rc;
    d->n++;
    if (exists(dir, "labels.json")) {
        rc = ggn_labels_read(dir, &v->labels, err);
        v->has_labels = !rc;
    }
    return rc;
}

static int compare_views(const void *a, const void *b)
{
    return strcmp(((const struct ggn_dataset_view *)a)->dir, ((const struct ggn_dataset_view *)b)->dir);
}

static int is_visible(const struct dirent *e) { return e->d_name[0] != '.'; }

/* Adds the sequences that are folders of `path` itself; in order of name, so that the first one that is wrong is the same on
 * every file system. */
static int scan(const char *path, enum ggn_split split, struct ggn_dataset *d, struct base_err *err)
{
    struct dirent **entries;
    int rc = 0, n = scandir(path, &entries, is_visible, alphasort);
    if (n < 0)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    for (int i = 0; i < n; i++) {
        char sub[4096];
        const int too_long = base_file_join(sub, path, entries[i]->d_name, NULL);
        free(entries[i]);
        if (rc || too_long || !exists(sub, "manifest.json"))
            continue;
        rc = add_view(d, sub, err);
        if (!rc)
            d->views[d->n - 1].split = split;
    }
    free(entries);
    return rc;
}

static int scan_all(const char *path, struct ggn_dataset *d, struct base_err *err)
{
    int rc = scan(path, GGN_SPLIT_NONE, d, err);
    for (int s = 0; s < GGN_SPLIT_NONE && !rc; s++) {
        char sub[4096];
        if (!base_file_join(sub, path, ggn_split_names[s], NULL) && exists(path, ggn_split_names[s]))
            rc = scan(sub, (enum ggn_split)s, d, err);
    }
    for (int i = 0; i < d->n && !rc; i++)
        for (int k = 0; k < i; k++)
            if (strcmp(d->views[i].manifest.scene, d->views[k].manifest.scene) == 0 &&
                d->views[i].split != d->views[k].split)
                rc = base_fail(err, BASE_EINVAL, "%s: scene '%s' is in %s and in %s", path, d->views[i].manifest.scene,
                               ggn_split_names[d->views[k].split], ggn_split_names[d->views[i].split]);
    if (!rc && d->n == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: no recorded sequence in it (no manifest.json)", path);
    return rc;
}

static int apply_scene(const char *path, const char *scene, enum ggn_split split, struct ggn_dataset *d,
                       struct base_err *err)
{
    const struct ggn_dataset_view *folder = NULL;
    int found = 0;
    for (int i = 0; i < d->n; i++) {
        struct ggn_dataset_view *view = &d->views[i];
        folder = strcmp(base_file_name(view->dir), scene) == 0 ? view : folder;
        if (strcmp(view->manifest.scene, scene) != 0)
            continue;
        if (view->split != GGN_SPLIT_NONE && view->split != split)
            return base_fail(err, BASE_EINVAL, "%s: scene '%s' is in %s and in %s", path, scene,
                             ggn_split_names[view->split], ggn_split_names[split]);
        view->split = split;
        found = 1;
    }
    if (!found && folder)
        return base_fail(err, BASE_EINVAL, "%s: %s: '%s' is a folder, whose scene is '%s'", path, ggn_split_names[split],
                         scene, folder->manifest.scene);
    return 0;
}

static int apply_list(const char *path, const cJSON *list, struct ggn_dataset *d, struct base_err *err)
{
    int s = 0, rc = 0;
    const cJSON *scene;
    while (s < GGN_SPLIT_NONE && strcmp(list->string, ggn_split_names[s]) != 0)
        s++;
    if (s == GGN_SPLIT_NONE)
        return base_fail(err, BASE_EINVAL, "%s: '%s' is none of train, validation, test, people", path, list->string);
    if (!cJSON_IsArray(list))
        return base_fail(err, BASE_EINVAL, "%s: %s: expected a list of scenes", path, list->string);
    cJSON_ArrayForEach (scene, list) {
        if (!rc)
            rc = cJSON_IsString(scene) ? apply_scene(path, scene->valuestring, (enum ggn_split)s, d, err)
                                       : base_fail(err, BASE_EINVAL, "%s: %s: a scene is a string", path, list->string);
    }
    return rc;
}

static int read_split(const char *dir, struct ggn_dataset *d, struct base_err *err)
{
    char path[4096], *text;
    size_t size;
    if (base_file_join(path, dir, "split.json", NULL) || !exists(dir, "split.json"))
        return 0;
    int rc = base_file_read(path, 1 << 24, &text, &size, err);
    if (rc)
        return rc;
    cJSON *root = cJSON_ParseWithLength(text, size);
    rc = cJSON_IsObject(root) ? 0 : base_fail(err, BASE_EINVAL, "%s: not a JSON object", path);
    for (const cJSON *list = rc ? NULL : root->child; list && !rc; list = list->next)
        rc = apply_list(path, list, d, err);
    cJSON_Delete(root);
    free(text);
    return rc;
}

int ggn_dataset_open(const char *path, struct ggn_dataset *data, struct base_err *err)
{
    struct ggn_dataset d = {0};
    int rc = exists(path, "manifest.json") ? add_view(&d, path, err) : scan_all(path, &d, err);
    if (!rc)
        rc = read_split(path, &d, err);
    if (rc) {
        ggn_dataset_release(&d);
        return rc;
    }
    qsort(d.views, (size_t)d.n, sizeof *d.views, compare_views);
    for (int i = 0; i < d.n; i++) {
        struct ggn_dataset_view *v = &d.views[i];
        v->name = base_file_name(v->dir);
        while (strcmp(d.views[v->first].manifest.scene, v->manifest.scene) != 0)
            v->first++;
        v->scene = v->first == i ? d.n_scenes++ : d.views[v->first].scene;
    }
    *data = d;
    return 0;
}

uint32_t ggn_dataset_tiles(const struct ggn_dataset_view *view)
{
    const struct seq_manifest *m = &view->manifest;
    return (m->width + m->block - 1) / m->block * ((m->height + m->block - 1) / m->block);
}

const char *ggn_dataset_label_source(const struct ggn_dataset *data)
{
    const char *source = NULL;
    for (int i = 0; i < data->n; i++)
        if (data->views[i].has_labels)
            source = !source || strcmp(source, data->views[i].labels.source) == 0 ? data->views[i].labels.source : "mixed";
    return source ? source : "none";
}

static int is_name(const char *name, const char *at, size_t length)
{
    return strlen(name) == length && memcmp(name, at, length) == 0;
}

/* list: comma-separated, or NULL. */
static int is_item(const char *list, const char *scene)
{
    for (size_t n; list && *list; list += n + (list[n] == ',')) {
        n = strcspn(list, ",");
        if (is_name(scene, list, n))
            return 1;
    }
    return 0;
}

/* Every scene that the option lists must be there. Who wrote a folder's name is told what it should have been. */
static int check_option(const struct ggn_dataset *data, const char *option, const char *list, struct base_err *err)
{
    for (size_t n; list && *list; list += n + (list[n] == ',')) {
        int scene = 0, folder = 0;
        n = strcspn(list, ",");
        while (scene < data->n && !is_name(data->views[scene].manifest.scene, list, n))
            scene++;
        if (scene < data->n)
            continue;
        while (folder < data->n && !is_name(data->views[folder].name, list, n))
            folder++;
        if (folder < data->n)
            return base_fail(err, BASE_EINVAL, "%s: no scene '%.*s' in the data: this folder's scene is '%s'", option,
                             (int)n, list, data->views[folder].manifest.scene);
        return base_fail(err, BASE_EINVAL, "%s: no scene '%.*s' in the data", option, n < 200 ? (int)n : 200, list);
    }
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
    *source = source_of(data, o);
    for (int i = 0; i < data->n; i++) {
        struct ggn_dataset_view *v = &data->views[i];
        const char *scene = v->manifest.scene;
        const int validation = is_item(o->validation, scene), test = is_item(o->test, scene);
        if (validation && test)
            return base_fail(err, BASE_EINVAL, "--validation and --test: both list the scene '%s'", scene);
        if (validation || test)
            v->split = test ? GGN_SPLIT_TEST : GGN_SPLIT_VALIDATION;
        else if (*source == GGN_SPLIT_BY_MODELS)
            v->split = by_models(o, scene);
        else if (*source == GGN_SPLIT_BY_FIFTHS)
            v->split = v->scene % 5 == fifth && !o->validation ? GGN_SPLIT_VALIDATION : GGN_SPLIT_TRAIN;
    }
    int rc = check_option(data, "--validation", o->validation, err);
    return rc ? rc : check_option(data, "--test", o->test, err);
}
