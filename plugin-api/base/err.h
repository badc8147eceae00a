/*
 * One-line error messages, owned by the caller.
 *
 * A function that can fail takes a `struct base_err *err` (may be NULL), returns 0 or a negative code, and on failure
 * leaves its outputs unchanged and one line of text in *err that says where and what to do. No thread safety: one err per
 * thread.
 */
#ifndef BASE_ERR_H
#define BASE_ERR_H

enum {
    BASE_EINVAL = -1,    /* bad input or argument: exit status 2 */
    BASE_ENOMEM = -2,    /* out of memory: exit status 1 */
    BASE_EIO = -3,       /* a file could not be read or written: exit status 2 */
    BASE_ECANCELLED = -4 /* the caller's callback said so */
};

struct base_err {
    int code; /* BASE_* of the first failure, 0 before */
    char text[512];
};

/* Writes code and the formatted line into *err (if not NULL) and returns code: `return base_fail(...)` reads well. */
int base_fail(struct base_err *err, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The usual out-of-memory failure; `what` names what was being allocated. */
int base_fail_nomem(struct base_err *err, const char *what);

#endif
