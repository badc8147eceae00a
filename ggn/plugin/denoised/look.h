/*
 * A look: one rectangle of the frame, with blocks that are due and what lies around them, is read from the host's view and
 * both halves of it are denoised (denoise/pair.h). The same pixels come out for a block whatever rectangle it is in.
 *
 *     gd_look_begin   the rectangle, and the blocks in it that are not asked about
 *     gd_look_put     each of those that are
 *     gd_look_run     denoises
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

struct gd_look {
    struct lull_denoised_pair pair;
    struct lull_rect box, known; /* the rectangle, which may reach beyond the frame, and what is read of it */
};

/* What the samples of a block are. */
enum gd_halves {
    GD_HALVES_DIFFER,
    GD_HALVES_PLAIN,     /* both halves are the same, of one colour, */
    GD_HALVES_STRUCTURED /* or of more */
};

/* frame: checked. quality: of struct lull_oidn_form. threads: that the denoiser may use. */
struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality, uint32_t threads);

/* library: as for lull_oidn_open. BASE_ENOMEM also for a frame too large to count its pixels. */
int gd_look_open(struct gd_look *look, const struct gd_form *form, const char *library, struct base_err *err);
void gd_look_close(struct gd_look *look);

/* Of pixels that are numbers; *tally counts pixels if the halves are the same. */
enum gd_halves gd_halves_of(const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally);

/* asked: [all blocks], whether gd_look_put reads it. With no view->all nothing is known but `core`, the only block asked. */
void gd_look_begin(struct gd_look *look, const struct gd_form *form, const struct lull_view *view,
                   const struct lull_rect *box, const struct lull_rect *core, const uint8_t *asked);
/* A block of 0 < half_spp < spp; *tally counts its pixels. */
void gd_look_put(struct gd_look *look, const struct lull_view *view, const struct lull_block *block,
                 struct lull_kit_tally *tally);
/* 0, or a negative code and *err. host: whose cancelled is asked; may be NULL. */
int gd_look_run(struct gd_look *look, const struct lull_host *host, struct base_err *err);

/* Where the block lies in the rectangle. */
struct lull_denoised_rect gd_look_place(const struct gd_look *look, const struct lull_block *block);

#endif
