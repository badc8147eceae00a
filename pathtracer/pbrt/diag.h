/*
 * Where in a scene file something is, and messages about it.
 *
 * A pt_diag is the one place where building a scene fails or warns. The first failure sticks (rc, err); later ones are
 * dropped, so that code may go on with default values until its directive ends. Not thread-safe; one per load.
 */
#ifndef PT_PBRT_DIAG_H
#define PT_PBRT_DIAG_H

#include <stdint.h>

#include "base/err.h"
#include "base/log.h"
#include "pbrt/names.h"

/* A place in a text file, 1-based; line 0 = the file as a whole, file NULL = no place. */
struct pt_loc {
    const char *file; /* borrows: lives as long as the lexer's arena */
    int32_t line, column;
};

struct pt_diag {
    struct base_err *err;     /* may be NULL */
    int rc;                   /* 0 until the first failure */
    int strict;               /* warnings are failures */
    int is_v3;                /* of pbrt-v3's, which goes on where a parameter is unknown */
    struct base_log *log;     /* may be NULL */
    struct pt_names reported; /* owns: texts of the warnings given, each once */
};

/* Records `file:line:column: text` with a code unless something failed before. Control characters become '?', so the text is
 * one line. Returns the sticky code. */
int pt_diag_fail_code(struct pt_diag *diag, int code, struct pt_loc loc, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
#define pt_diag_fail(diag, loc, ...) pt_diag_fail_code(diag, BASE_EINVAL, loc, __VA_ARGS__)
/* A file that the scene names could not be read. Returns the sticky code. */
int pt_diag_fail_read(struct pt_diag *diag, struct pt_loc loc, const struct base_err *why);
/* Out of memory while making `what`. */
int pt_diag_nomem(struct pt_diag *diag, const char *what);
/* Something is approximated or ignored: `file:line: warning: text`, a note, each text once. A failure when strict. */
void pt_diag_warn(struct pt_diag *diag, struct pt_loc loc, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* A name that nobody knows: fails, but warns in v3, as pbrt-v3 does, which takes `instead`. Returns the sticky code. */
int pt_diag_unknown(struct pt_diag *diag, struct pt_loc loc, const char *what, const char *name, const char *known,
                    const char *instead);
void pt_diag_release(struct pt_diag *diag);

#endif
