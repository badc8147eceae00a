/*
 * Whole-file reads and atomic writes of regular files. Folders, devices, FIFOs and sockets are refused on either side:
 * reading them may never end, and an output takes the place of what was there.
 *
 * An output is written to a temporary beside PATH and renamed onto PATH by base_file_commit, so that a reader sees the old
 * file or the new one and never a part. A symbolic link is followed, the permissions of an old file stay. A temporary is
 * locked while its process lives; those that a killed process left in a folder are removed when the next output there is
 * checked or begun. Not thread-safe per object.
 */
#ifndef BASE_FILES_H
#define BASE_FILES_H

#include <stddef.h>
#include <stdio.h>

#include "base/err.h"

/* Opens a regular file for reading; waits for nothing. The caller closes it. */
int base_file_open(const char *path, FILE **file, struct base_err *err);
/* For libraries that open inputs by name themselves: fails where base_file_open would. */
int base_file_check_input(const char *path, struct base_err *err);
/* Reads all of a regular file. *data is malloc'ed (caller frees), NUL-terminated one past *size. Files above max_size bytes
 * and anything but regular files are refused (BASE_EINVAL). */
int base_file_read(const char *path, size_t max_size, char **data, size_t *size, struct base_err *err);

/* What stands behind the last '/' of a path; borrows. */
const char *base_file_name(const char *path);
/* Whether it ends in .ENDING, in small or capital letters. */
int base_file_has_ending(const char *path, const char *ending);
/* DIR/NAME; path has room for 4096 bytes. */
int base_file_join(char *path, const char *dir, const char *name, struct base_err *err);

/* Can `path` be written? To be asked before the work: BASE_EIO when its folder is missing or read-only, BASE_EINVAL when
 * the name is too long or what is there is no regular file. NULL is no output. */
int base_file_check_output(const char *path, struct base_err *err);

/* What files of a program's own begin with, and what they are called: "checkpoint". */
struct base_file_kind {
    const char *name;
    unsigned char magic[8];
};
/* BASE_EINVAL when there is a file at `path` that is neither empty nor of this kind: what a program keeps for itself takes
 * the place of nothing but its like. NULL is no output. */
int base_file_check_kind(const char *path, const struct base_file_kind *kind, struct base_err *err);

/* 1 when writing `a` and writing `b` changes one and the same file, also when neither is there yet. */
int base_file_is_same(const char *a, const char *b);

/* 1 when writing `path` would put a file into `folder` or one of its folders. */
int base_file_is_inside(const char *path, const char *folder);

struct base_file_out {
    FILE *file;      /* open for writing between begin and commit/abort */
    int durable;     /* set after begin: the folder is synced too, so that the new file is there after a power failure */
    char path[4096]; /* the final name, links followed */
    char tmp_path[4128];
};

/* Makes a folder, unless it is there. *made (may be NULL): whether it is new. */
int base_make_folder(const char *path, int *made, struct base_err *err);

/* Opens the temporary file beside `path`. On failure nothing is left behind. */
int base_file_begin(struct base_file_out *out, const char *path, struct base_err *err);
/* Flushes, syncs, closes and renames; on failure removes the temporary and keeps the old file. */
int base_file_commit(struct base_file_out *out, struct base_err *err);
/* All of that for a text, which gets a newline at its end. */
int base_file_write_line(const char *path, const char *text, struct base_err *err);
/* Closes and removes the temporary. Safe after commit and on a zeroed object. */
void base_file_abort(struct base_file_out *out);

/* A folder that one process at a time may write to. The lock is a record lock on DIR/.lock: it ends with its process,
 * however that ends, and holds between machines where the file system does. Of no use within one process. */
struct base_lock {
    int fd; /* 0: not held */
    char path[4096];
};

/* BASE_EINVAL, with the number of the process that holds it, when the folder is taken. */
int base_lock_folder(struct base_lock *lock, const char *dir, struct base_err *err);
/* Safe on a zeroed object. */
void base_lock_release(struct base_lock *lock);

#endif
