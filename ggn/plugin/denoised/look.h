/*
 * A look: one rectangle of the frame, with blocks that are due and what lies around them, is read from the host's view and
 * both halves of it are denoised (denoise/pair.h). The same pixels come out for a block whatever rectangle it is in.
 *
 * One thread; nothing is allocated after gd_look_open.
 */
#ifndef GGN_PLUGIN_DENOISED_LOOK_H
#define GGN_PLUGIN_DENOISED_LOOK_H

#include <lull/criterion_kit.h>

#include "denoise/pair.h"

/* Pixels beyond a block's edges that its answer depends on, at most. */
enum { GD_REACH = LULL_OIDN_HALO + LULL_OIDN_GRID - 1 };

struct gd_form {           /* of a frame */
    struct lull_rect area; /* around all blocks */
    uint32_t blocks;
    int32_t width, height;      /* of the largest blocks */
    int64_t most;               /* pixels of the largest rectangle */
    struct lull_oidn_form room; /* as many pixels, of any shape */
};

/* What the samples of a block are. */
enum gd_halves {
    GD_HALVES_DIFFER,
    GD_HALVES_PLAIN,     /* both halves are the same, of one colour, */
    GD_HALVES_STRUCTURED /* or of more */
};

struct gd_look {
    struct lull_denoised_pair pair;
    struct lull_rect box, known; /* the rectangle, which may reach beyond the frame, and what is read of it */
    uint8_t *asked;              /* [blocks]: asked about, and in the rectangle; 0 between looks */
};

/* frame: checked. quality: of struct lull_oidn_form. threads: that the denoiser may use. */
struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality, uint32_t threads);

/* library: as for lull_oidn_open. BASE_ENOMEM also for a frame too large to count its pixels. */
int gd_look_open(struct gd_look *look, const struct gd_form *form, const char *library, struct base_err *err);
void gd_look_close(struct gd_look *look);

/* Of pixels that are numbers; *tally counts pixels if the halves are the same. */
enum gd_halves gd_halves_of(const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally);

/* Some blocks of a question, of 0 < half_spp < spp, are read and all in the box denoised; tally: [all blocks], counts the
 * pixels of each. With no view->all nothing else is known, and there is one. 0, or a negative code and *err. */
int gd_look_run(struct gd_look *look, const struct gd_form *form, const struct lull_kit_batch *batch,
                const struct lull_rect *box, const uint32_t *members, uint32_t count, struct lull_kit_tally *tally,
                struct base_err *err);

/* Where the block lies in the rectangle. */
struct lull_denoised_rect gd_look_place(const struct gd_look *look, const struct lull_block *block);

#endif
