/*
 * What a command reads and what it writes. Zeroed objects are empty lists.
 *
 * - Inputs: the files, or folders of them, that a result is made from, what a checkpoint has to notice when it has changed,
 *   and what an output must not replace. Adding is thread-safe, the rest is not.
 * - Outputs: the files that are going to be written, looked at before the work: each can be written, no two are one file,
 *   and none is an input or in a folder that is one. Files are told apart by what they are, not by how they are called:
 *   links, other ways to a folder and files that are not there yet are seen through (base_file_is_same).
 */
#ifndef BASE_PATHS_H
#define BASE_PATHS_H

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct base_inputs {
    pthread_mutex_t lock;
    char **paths; /* owns; [count], sorted, each once */
    size_t count, room;
};

#define BASE_INPUTS_EMPTY \
    { \
        .lock = PTHREAD_MUTEX_INITIALIZER \
    }

/* Copies `path`. A path that is there already is no error. */
int base_inputs_add(struct base_inputs *inputs, const char *path, struct base_err *err);
/* CRC-32 (zlib's) of the files' bytes one after the other, in the order of their names. Reads them all; no folders. */
int base_inputs_crc32(const struct base_inputs *inputs, uint32_t *crc, struct base_err *err);
/* BASE_EINVAL when writing `output` would overwrite one of them, by whatever name, or put a file into a folder of them; NULL
 * is no output. */
int base_inputs_protect(const struct base_inputs *inputs, const char *output, struct base_err *err);
void base_inputs_release(struct base_inputs *inputs);

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
/* The same for a folder in which files will be written. */
int base_outputs_protect_folder(const char *folder, const struct base_inputs *inputs, struct base_err *err);

#endif
