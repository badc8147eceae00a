/*
 * The files that a command is going to write, looked at before its work: each can be written, no two are one file, and none
 * is an input or in a folder that is one. Files are told apart by what they are, not by how they are called: links, other
 * ways to a folder and files that are not there yet are seen through (base_file_is_same). A zeroed object is an empty list.
 * Not thread-safe.
 */
#ifndef BASE_OUTPUTS_H
#define BASE_OUTPUTS_H

#include "base/err.h"
#include "base/inputs.h"

enum { BASE_OUTPUTS_MAX = 24 };

struct base_outputs {
    struct {
        const char *option, *path; /* borrowed; option: its long name without dashes */
    } list[BASE_OUTPUTS_MAX];
    int count;
};

/* Adds a file; a path that is NULL is no output. Fails as base_file_check_output does, and with BASE_EINVAL when it is one
 * of the list already. */
int base_outputs_add(struct base_outputs *outputs, const char *option, const char *path, struct base_err *err);
/* BASE_EINVAL when one of them is an input or in a folder that is one. */
int base_outputs_protect(const struct base_outputs *outputs, const struct base_inputs *inputs, struct base_err *err);
/* The same for a folder in which files of these names (ends with NULL; may be NULL) will be written, among others. */
int base_outputs_protect_folder(const char *folder, const char *const *names, const struct base_inputs *inputs,
                                struct base_err *err);

#endif
