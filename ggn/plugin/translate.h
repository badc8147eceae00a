/* What the ABI says, in ggn's own terms, and the other way round. Pure functions, any thread. */
#ifndef GGN_PLUGIN_TRANSLATE_H
#define GGN_PLUGIN_TRANSLATE_H

#include <stdatomic.h>

#include <lull/criterion_kit.h>

#include "base/err.h"
#include "sight/preprocess.h"

/* Fills *err (may be NULL) from an error of ggn's own functions, `what` before its text; returns the LULL_E_ code: that of
 * no memory, of a cancelled call, or `otherwise`. */
int32_t gp_fail_from(struct lull_error *err, int32_t otherwise, const char *what, const struct base_err *from);

/* Says it to a host that listens. */
void gp_log(const struct lull_kit *kit, int32_t level, const char *text);
/* Likewise, unless *said, which it sets: once per frame where begin_frame clears it. */
void gp_say_once(const struct lull_kit *kit, int32_t level, atomic_flag *said, const char *text);

/* Whether HALF holds some of the block's samples and not all. */
static inline int gp_has_halves(const struct lull_block *b) { return b->half_spp > 0 && b->half_spp < b->spp; }
/* The error of a block whose two pictures are the same everywhere. 0 where it is of one colour: black or evenly lit, it
 * shows no noise. With structure the host has given the same samples twice: bad input, a warning `text`, NaN. */
double gp_error_of_same(const struct lull_kit *kit, int has_structure, atomic_flag *warned, const char *text,
                        struct lull_kit_tally *tally);

/* LULL_E_INVALID unless the block is the frame's with this id, at `rect`, and has at least the spp of the last question. */
int32_t gp_check_block(const struct lull_block *block, const struct lull_rect *rect, uint64_t spp_before,
                       struct lull_error *err);

/* How the host of the open frame shows the picture; sRGB where it does not say. */
struct ggn_display gp_display_of(const struct lull_kit *kit);

/* The light that a display sends, in [0, 1], relative to its white. */
float gp_shown(const struct lull_kit *kit, double radiance);

#endif
