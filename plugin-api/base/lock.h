/*
 * A folder that one process at a time may write to. The lock is a record lock on DIR/.lock: it ends with its process,
 * however that ends, and holds between machines where the file system does. Not thread-safe; of no use within one process.
 */
#ifndef BASE_LOCK_H
#define BASE_LOCK_H

#include "base/err.h"

struct base_lock {
    int fd; /* 0: not held */
    char path[4096];
};

/* BASE_EINVAL, with the number of the process that holds it, when the folder is taken. */
int base_lock_folder(struct base_lock *lock, const char *dir, struct base_err *err);
/* Safe on a zeroed object. */
void base_lock_release(struct base_lock *lock);

#endif
