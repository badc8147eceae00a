#include "base/paths.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/files.h"

/* Where `path` is or belongs. */
static size_t place_of(const struct base_inputs *inputs, const char *path)
{
    size_t low = 0, high = inputs->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(inputs->paths[middle], path) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int insert(struct base_inputs *inputs, const char *path, struct base_err *err)
{
    size_t at = place_of(inputs, path);
    if (at < inputs->count && !strcmp(inputs->paths[at], path))
        return 0;
    if (inputs->count == inputs->room) {
        size_t room = 2 * inputs->room + 16;
        char **paths = realloc(inputs->paths, room * sizeof *paths);
        if (!paths)
            return base_fail_nomem(err, path);
        inputs->paths = paths;
        inputs->room = room;
    }
    char *copy = strdup(path);
    if (!copy)
        return base_fail_nomem(err, path);
    memmove(inputs->paths + at + 1, inputs->paths + at, (inputs->count++ - at) * sizeof *inputs->paths);
    inputs->paths[at] = copy;
    return 0;
}

int base_inputs_add(struct base_inputs *inputs, const char *path, struct base_err *err)
{
    pthread_mutex_lock(&inputs->lock);
    int rc = insert(inputs, path, err);
    pthread_mutex_unlock(&inputs->lock);
    return rc;
}

int base_inputs_protect(const struct base_inputs *inputs, const char *output, struct base_err *err)
{
    struct stat out, in;
    int exists = output && stat(output, &out) == 0;
    for (size_t i = 0; output && i < inputs->count; i++) {
        const char *path = inputs->paths[i];
        if (stat(path, &in) != 0)
            continue;
        if (S_ISDIR(in.st_mode) && base_file_is_inside(output, path))
            return base_fail(err, BASE_EINVAL, "%s: this is inside its data, %s", output, path);
        if (exists && in.st_dev == out.st_dev && in.st_ino == out.st_ino)
            return base_fail(err, BASE_EINVAL, "%s: this is an input (%s), it would be overwritten", output, path);
    }
    return 0;
}

void base_inputs_release(struct base_inputs *inputs)
{
    for (size_t i = 0; i < inputs->count; i++)
        free(inputs->paths[i]);
    free(inputs->paths);
    inputs->paths = NULL;
    inputs->count = inputs->room = 0;
}

int base_outputs_add(struct base_outputs *o, const char *option, const char *path, struct base_err *err)
{
    int rc = base_file_check_output(path, err);
    if (rc || !path)
        return rc;
    for (int i = 0; i < o->count; i++)
        if (base_file_is_same(path, o->list[i].path))
            return base_fail(err, BASE_EINVAL, "--%s %s: the same file as --%s %s, one of the two would be lost", option,
                             path, o->list[i].option, o->list[i].path);
    if (o->count == BASE_OUTPUTS_MAX)
        return base_fail(err, BASE_EINVAL, "--%s %s: more than %d files to be written", option, path, BASE_OUTPUTS_MAX);
    o->list[o->count].option = option;
    o->list[o->count++].path = path;
    return 0;
}

int base_outputs_protect(const struct base_outputs *o, const struct base_inputs *inputs, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < o->count && !rc; i++)
        rc = base_inputs_protect(inputs, o->list[i].path, err);
    return rc;
}

int base_outputs_protect_folder(const char *folder, const struct base_inputs *inputs, struct base_err *err)
{
    char path[4096], bare[4096];
    int rc = base_file_join(path, folder, ".", err); /* is the folder one of theirs, if it is there? */
    if (rc)
        return rc;
    rc = base_inputs_protect(inputs, path, err);
    strcpy(bare, folder);
    for (size_t n = strlen(bare); n > 1 && bare[n - 1] == '/';)
        bare[--n] = '\0';
    return rc ? rc : base_inputs_protect(inputs, bare, err); /* and would it be made in one of theirs? */
}
