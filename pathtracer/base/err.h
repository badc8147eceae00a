/*
 * One-line error messages, owned by the caller.
 *
 * A function that can fail takes a `struct pt_err *err` (may be NULL), returns PT_OK or a negative code, and on failure
 * leaves its outputs unchanged and one line of text in *err that says where and what to do. No thread safety: one err per
 * thread.
 */
#ifndef PT_BASE_ERR_H
#define PT_BASE_ERR_H

enum {
    PT_OK = 0,
    PT_EINVAL = -1, /* bad input or argument: exit status 2 */
    PT_ENOMEM = -2, /* out of memory: exit status 1 */
    PT_EIO = -3     /* a file could not be read or written: exit status 2 */
};

struct pt_err {
    int code; /* PT_* of the first failure, PT_OK before */
    char text[512];
};

/* Writes code and the formatted line into *err (if not NULL) and returns code, so that `return pt_fail(...)` reads well. */
int pt_fail(struct pt_err *err, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The usual out-of-memory failure; `what` names what was being allocated. */
int pt_fail_nomem(struct pt_err *err, const char *what);

#endif
