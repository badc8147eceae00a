/*
 * Text across the boundary: error messages out, parameter values in. Pure functions, any thread.
 */
#ifndef GGN_PLUGIN_TEXT_H
#define GGN_PLUGIN_TEXT_H

#include <lull/criterion.h>

#include "base/err.h"

/* Fills *err (may be NULL or too small) and returns code. */
int32_t gp_fail(struct lull_error *err, int32_t code, const char *format, ...) __attribute__((format(printf, 3, 4)));
/* The same from an error of ggn's own functions, `what` before its text. */
int32_t gp_fail_from(struct lull_error *err, const char *what, const struct base_err *from);

/* A decimal number that fills the whole text, in the C locale whatever the process has set. Returns 0 if it is none. */
int gp_number(const char *text, double *out);

/* Index of the parameter that `key` names, checked against its type and range; INT, FLOAT and BOOL put the number into *value,
 * CHOICE the index of the choice. On failure a negative LULL_E_ code. */
int32_t gp_param(const struct lull_param *params, uint32_t count, const char *key, const char *text, double *value,
                 struct lull_error *err);

#endif
