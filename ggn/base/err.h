/*
 * One-line error messages, owned by the caller.
 *
 * A function that can fail takes a `struct ggn_err *err` (may be NULL), returns GGN_OK or a negative code, and on failure
 * leaves its outputs unchanged and one line of text in *err that says where and what to do. No thread safety: one err per
 * thread.
 */
#ifndef GGN_BASE_ERR_H
#define GGN_BASE_ERR_H

enum {
    GGN_OK = 0,
    GGN_EINVAL = -1, /* bad input or argument: exit status 2 */
    GGN_ENOMEM = -2, /* out of memory: exit status 1 */
    GGN_EIO = -3     /* a file could not be read or written: exit status 2 when it is an input, 1 when an output */
};

struct ggn_err {
    int code; /* GGN_* of the first failure, GGN_OK before */
    char text[512];
};

/* Writes code and the formatted line into *err (if not NULL) and returns code, so that `return ggn_fail(...)` reads well. */
int ggn_fail(struct ggn_err *err, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* The usual out-of-memory failure; `what` names what was being allocated. */
int ggn_fail_nomem(struct ggn_err *err, const char *what);

#endif
