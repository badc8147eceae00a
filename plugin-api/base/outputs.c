#include "base/outputs.h"

#include <string.h>

#include "base/files.h"

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

int base_outputs_protect_folder(const char *folder, const char *const *names, const struct base_inputs *inputs,
                                struct base_err *err)
{
    char path[4096], bare[4096];
    int rc = base_file_join(path, folder, ".", err); /* is the folder one of theirs, if it is there? */
    if (rc)
        return rc;
    rc = base_inputs_protect(inputs, path, err);
    strcpy(bare, folder);
    for (size_t n = strlen(bare); n > 1 && bare[n - 1] == '/';)
        bare[--n] = '\0';
    if (!rc) /* and would it be made in one of theirs? */
        rc = base_inputs_protect(inputs, bare, err);
    for (int i = 0; names && names[i] && !rc; i++) {
        rc = base_file_join(path, folder, names[i], err);
        if (!rc)
            rc = base_inputs_protect(inputs, path, err);
    }
    return rc;
}
