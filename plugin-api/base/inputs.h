/*
 * The files, or folders of them, that a result is made from: what a checkpoint has to notice when it has changed, and what
 * an output must not replace. A zeroed object is an empty list. Adding is thread-safe, the rest is not.
 */
#ifndef BASE_INPUTS_H
#define BASE_INPUTS_H

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

#endif
