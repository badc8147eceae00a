/* What the ABI says, in ggn's own terms, and the other way round. Pure functions, any thread. */
#ifndef GGN_PLUGIN_TRANSLATE_H
#define GGN_PLUGIN_TRANSLATE_H

#include <lull/criterion_kit.h>

#include "base/err.h"
#include "model/preprocess.h"

/* Fills *err (may be NULL) from an error of ggn's own functions, `what` before its text; returns the LULL_E_ code. */
int32_t gp_fail_from(struct lull_error *err, const char *what, const struct base_err *from);

/* How the host of the open frame shows the picture; sRGB where it does not say. */
struct ggn_display gp_display_of(const struct lull_kit *kit);

/* The light that a display sends, in [0, 1], relative to its white. */
float gp_shown(const struct lull_kit *kit, double radiance);

/* Arguments of lull.state/1: a struct of this version's size or longer, nothing missing, an open frame. */
int32_t gp_save_check(const struct lull_instance *instance, const struct lull_writer *writer, struct lull_error *err);
int32_t gp_load_check(const struct lull_instance *instance, const struct lull_reader *reader, struct lull_error *err);

#endif
