/*
 * Whole-file reads and atomic writes.
 *
 * An output is written to a temporary beside PATH and renamed onto PATH by base_file_commit, so that a reader sees the old
 * file or the new one and never a part. Not thread-safe per object.
 */
#ifndef BASE_FILES_H
#define BASE_FILES_H

#include <stddef.h>
#include <stdio.h>

#include "base/err.h"

/* Reads all of a regular file. *data is malloc'ed (caller frees), NUL-terminated one past *size. Files above max_size bytes
 * and anything but regular files are refused (BASE_EINVAL). */
int base_file_read(const char *path, size_t max_size, char **data, size_t *size, struct base_err *err);

/* DIR/NAME; path has room for 4096 bytes. */
int base_file_join(char *path, const char *dir, const char *name, struct base_err *err);

struct base_file_out {
    FILE *file;         /* open for writing between begin and commit/abort */
    char path[4096];    /* the final name */
    char tmp_path[4128];
};

/* Opens the temporary file beside `path`. On failure nothing is left behind. */
int base_file_begin(struct base_file_out *out, const char *path, struct base_err *err);
/* Flushes, syncs, closes and renames; on failure removes the temporary and keeps the old file. */
int base_file_commit(struct base_file_out *out, struct base_err *err);
/* All of that for a text, which gets a newline at its end. */
int base_file_write_line(const char *path, const char *text, struct base_err *err);
/* Closes and removes the temporary. Safe after commit and on a zeroed object. */
void base_file_abort(struct base_file_out *out);

/* For writers that open files by name themselves (EXR, OpenImageIO): makes the temporary's name, which keeps the extension
 * of `path`; base_file_rename puts it in place. tmp_path has room for `room` bytes. */
int base_file_tmp_name(const char *path, char *tmp_path, size_t room, struct base_err *err);
int base_file_rename(const char *tmp_path, const char *path, struct base_err *err);

#endif
