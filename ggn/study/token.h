/* Unguessable names. Any thread. */
#ifndef GGN_STUDY_TOKEN_H
#define GGN_STUDY_TOKEN_H

#include "base/err.h"

/* out gets `digits` (at most 64) hex digits of the kernel's randomness and a NUL. */
int ggn_study_token(char *out, int digits, struct base_err *err);
/* Whether two texts are equal, in a time that does not tell where they differ. */
int ggn_study_token_equal(const char *a, const char *b);

#endif
