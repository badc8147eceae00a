/*
 * Whole-file reads and atomic writes.
 *
 * An output is written to PATH.tmp.PID and renamed onto PATH by ggn_fio_commit, so that a reader sees the old file or the new
 * one and never a part. Not thread-safe per object.
 */
#ifndef GGN_BASE_FIO_H
#define GGN_BASE_FIO_H

#include <stddef.h>
#include <stdio.h>

#include "base/err.h"

/* Reads all of a regular file. *data is malloc'ed (caller frees), NUL-terminated one past *size. Files above max_size bytes
 * and anything but regular files are refused (GGN_EINVAL). */
int ggn_fio_read(const char *path, size_t max_size, char **data, size_t *size, struct ggn_err *err);

/* DIR/NAME; path has room for 4096 bytes. */
int ggn_fio_join(char *path, const char *dir, const char *name, struct ggn_err *err);

struct ggn_fio_out {
    FILE *file;         /* open for writing between begin and commit/abort */
    char path[4096];    /* the final name */
    char tmp_path[4128];
};

/* Opens the temporary file beside `path`. On failure nothing is left behind. */
int ggn_fio_begin(struct ggn_fio_out *out, const char *path, struct ggn_err *err);
/* Flushes, syncs, closes and renames; on failure removes the temporary and keeps the old file. */
int ggn_fio_commit(struct ggn_fio_out *out, struct ggn_err *err);
/* All of that for a text, which gets a newline at its end. */
int ggn_fio_write_line(const char *path, const char *text, struct ggn_err *err);
/* Closes and removes the temporary. Safe after commit and on a zeroed object. */
void ggn_fio_abort(struct ggn_fio_out *out);

/* For writers that open files by name themselves (EXR, OpenImageIO): makes the temporary's name, which keeps the extension
 * of `path`; ggn_fio_rename puts it in place. tmp_path has room for `room` bytes. */
int ggn_fio_tmp_name(const char *path, char *tmp_path, size_t room, struct ggn_err *err);
int ggn_fio_rename(const char *tmp_path, const char *path, struct ggn_err *err);

#endif
