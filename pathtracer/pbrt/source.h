/* Where the bytes of scene files come from: the disk, or memory in tests and fuzzers. */
#ifndef PT_PBRT_SOURCE_H
#define PT_PBRT_SOURCE_H

#include <stddef.h>

#include "base/err.h"
#include "base/paths.h"

struct pt_source {
    /* Reads all of `path`; *bytes is malloc'ed (caller frees) and NUL-terminated one past *size. Must be thread-safe. */
    int (*read)(void *data, const char *path, char **bytes, size_t *size, struct base_err *err);
    /* Told about a real file that another library is about to read itself; NULL: not called. */
    int (*note)(void *data, const char *path, struct base_err *err);
    void *data;
    int files; /* 1: paths are real files that other libraries may open */
};

/* The file system. Names that end in .gz, in small letters or capitals, are unpacked. Files above 2 GiB are refused. Every
 * file read is put into `inputs` (borrowed; may be NULL). */
struct pt_source pt_source_files(struct base_inputs *inputs);

/* What a gzip file holds, all of its members after each other; as pt_source.read. BASE_EINVAL when one is damaged, or when
 * something else follows the last. */
int pt_source_unpack(const char *name, const char *packed, size_t packed_size, char **bytes, size_t *size,
                     struct base_err *err);

#endif
