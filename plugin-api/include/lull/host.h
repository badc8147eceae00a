/* SPDX-License-Identifier: MIT
 *
 * lull/host.h - the host's side of a criterion (lull/criterion.h): everything of it that is the same in every renderer.
 *
 * The renderer keeps its film and its samples. The library opens a criterion by name, lays out the blocks, says up to which
 * sample each is to be rendered, shows the criterion the renderer's planes as they lie in memory, and stops or schedules
 * each block. It knows the limits, re-opens blocks, scales the criterion by a mask, forecasts, and writes report, stop map
 * and state. Link with -llull-host (pkg-config lull-host). C99 and C++11; examples/host.cpp is the smallest host.
 *
 *     lull_host_open(NULL, "observer", NULL, 0, &criterion, &err)         which planes? lull_host_needs(criterion)
 *     lull_host_begin(&config, criterion, &frame, &err)                   limits, size; blocks = lull_host_blocks_of(frame)
 *     while (lull_host_active(blocks) > 0) {
 *         render each block whose reason is LULL_REASON_NONE up to its next_spp; write its spp, half_spp, thread_s
 *         lull_host_check(frame, &view, &err)                             asks about them; stops or schedules each
 *     }
 *     lull_host_stop_map(blocks, "stops.png", "scene", &err); lull_host_report_write(…);
 *     lull_host_end(frame); lull_host_close(criterion);
 *
 * Rules of criterion.h hold here too: sizes, status codes, errors, text, pixels, NaN for what is not known. In addition:
 *
 * Sizes.    A struct that its caller makes begins with struct_size; later minor versions append fields. Structs without it
 *           never grow. host-layout-1.txt lists every offset.
 * Errors.   Functions that return int32_t return LULL_OK or a negative LULL_E_ code, and then fill err, which may be NULL
 *           and else begins with its struct_size. A failed call changes nothing unless its comment says so. A number or a
 *           pointer that makes no sense is refused by its name, a pointer to a struct or to text being not NULL where no
 *           comment says that it may be.
 * Warnings. Without a log in the services, the first warning of a criterion comes through err: the call returns LULL_OK
 *           and fills err with the code LULL_OK and the text. Else a call that succeeds leaves err as it is.
 * Threads.  Calls about one criterion and its frames never overlap. Different criteria may be used at the same time as far
 *           as their thread level allows.
 * Frozen.   What is here stays as it is through all versions 1: layouts, names, meaning. lull/host_draft.h has the rest of
 *           the library, which may still change: forecast, quote, page, denoised picture, live view, files.
 * Numbers.  The same samples give the same decisions whatever the order in which blocks and threads finish.
 */
#ifndef LULL_HOST_H
#define LULL_HOST_H

#include <lull/criterion.h>
#include <lull/loader.h>

#define LULL_HOST_MAJOR 1 /* part of the names of the file and of its symbols' version */
#define LULL_HOST_MINOR 2 /* a comment says since which version something is there; else since 1.0 */

#ifdef __cplusplus
extern "C" {
#endif

struct lull_host_criterion; /* an instance of a criterion */
struct lull_host_frame;     /* a picture in the making: its blocks, its totals, its criterion */

/* --- open: a criterion ---------------------------------------------------------------------------------------------- */

/* What the renderer offers a criterion while it is asked; copied. NULL instead of one: one thread, and of the messages only
 * the first warning, through err. */
struct lull_host_services {
    uint32_t struct_size;
    uint32_t threads; /* that work while it is asked; 0 reads as 1 */
    const char *name; /* of the renderer, with its version; for messages; copied; may be NULL */
    void *context;    /* the renderer's own, for the functions below */

    /* Gets one line, "criterion ID: …", of LULL_LOG_ level; may be called from any thread. May be NULL. */
    void (*log)(void *context, int32_t level, const char *text);

    /* The renderer's own pool of `threads` workers: as parallel_for of struct lull_host. NULL: the library makes `threads`
     * of its own when the criterion is opened, and ends them when it is closed. */
    int32_t (*parallel_for)(void *context, uint64_t count, lull_task_fn fn, void *arg);

    /* Called once with the context: when the criterion is closed, or could not be opened. May be NULL. */
    void (*release)(void *context);
};

/* Finds the criterion that spec names (as lull_open with the usual folders) and makes an instance of it with parameters,
 * which are copied. Errors say "criterion ID: " and what is wrong. */
LULL_EXPORT int32_t lull_host_open(const struct lull_host_services *services, const char *spec,
                                   const struct lull_pair *pairs, uint32_t pair_count, struct lull_host_criterion **out,
                                   struct lull_error *err);
/* The same of a table that was found already. */
LULL_EXPORT int32_t lull_host_create(const struct lull_host_services *services, const struct lull_criterion *table,
                                     const struct lull_pair *pairs, uint32_t pair_count, struct lull_host_criterion **out,
                                     struct lull_error *err);
/* Ends its frame, if one is open, and frees it; NULL is allowed. Frames that ask it must have ended, or never ask again. */
LULL_EXPORT void lull_host_close(struct lull_host_criterion *criterion);

/* What it is and what it needs; borrowed until close. */
LULL_EXPORT const struct lull_criterion *lull_host_table(const struct lull_host_criterion *criterion);
LULL_EXPORT const struct lull_requirements *lull_host_needs(const struct lull_host_criterion *criterion);

/* What parameter `name` is set to: the last of pairs with that key, else the criterion's default, which may be NULL. NULL
 * too when it has no such parameter. *found, which may be NULL, gets the parameter itself or NULL. */
LULL_EXPORT const char *lull_host_parameter(const struct lull_criterion *table, const char *name,
                                            const struct lull_pair *pairs, uint32_t pair_count,
                                            const struct lull_param **found);

/* --- open: a frame -------------------------------------------------------------------------------------------------- */

#define LULL_HOST_UNIFORM UINT32_C(0x100)    /* every block gets spp_max samples, and is asked about once at the end */
#define LULL_HOST_HALF_KNOWN UINT32_C(0x200) /* half_spp follows from spp: the renderer sets it, and no state holds it */
/* Checks are where they would be without spp_max: next_spp may lie beyond it. The renderer stops a block at spp_max all the
 * same, and saves the state when every active block is there, before it asks about them for the last time: a frame with
 * another spp_max goes on from that state as if it had begun with it. */
#define LULL_HOST_OPEN_ENDED UINT32_C(0x400)

/* Copied by lull_host_begin. Everything that may be 0 is so in a zeroed struct. */
struct lull_host_config {
    uint32_t struct_size;
    uint32_t flags;         /* LULL_HOST_, and LULL_FRAME_DETERMINISTIC, INDEPENDENT, SHARED, which the criterion is told */
    uint32_t width, height; /* of the whole picture, pixels */

    /* The blocks are a grid that starts at the upper left corner … */
    uint32_t block_width, block_height; /* 0: what the criterion was made for, or 200, or less for at least 12 blocks */
    int32_t crop[4]; /* x0, y0, x1, y1; all 0: none. Blocks that it touches are rendered whole; without a criterion they
                      * are cut to it, since no criterion judges them */
    /* … or any disjoint rectangles inside the picture; NULL: the grid. */
    const struct lull_rect *layout;
    uint32_t layout_count, layout_stride; /* stride: bytes */

    uint32_t planes;  /* mask of the planes that every view will hold, COLOR among them */
    int32_t transfer; /* LULL_TRANSFER_, and gamma, exposure, sample_clamp, rgb_to_xyz: as in struct lull_frame */
    double gamma;
    double exposure; /* 0 reads as 1 */
    double sample_clamp;
    double rgb_to_xyz[9];      /* all 0: linear sRGB */
    uint64_t spp_min, spp_max; /* 1 <= spp_min <= spp_max <= 2^31 - 1 */
    uint64_t seed;
    double time_budget_s; /* seconds that rendering and checks may take together, spent where errors are largest; 0: any */
    double max_check_overhead; /* share of these seconds that checks may take; 0: any. Others are left out */
    double max_seam;           /* most ratio of samples of neighbouring blocks, at least 1; 0: any (lull_host_reopen) */
    uint64_t check_step;       /* checks stand at multiples of so many samples, or at spp_max; 0 reads as 1 */

    /* A grey plane of the whole picture in [0, 1] (f32 or f64, 1 channel, LULL_NORM_ONE), read by lull_host_begin; NULL:
     * none. White takes a quarter of the criterion's quality parameter, the first of `error`, `visible` and `threshold` that
     * has a value; black leaves it, grey g takes 4^-g of it, in steps of an eighth. The lightest pixel of a block counts. */
    const struct lull_plane *mask;
};

#define LULL_REASON_NONE 0      /* the block is active: it gets samples */
#define LULL_REASON_CRITERION 1 /* the criterion said stop */
#define LULL_REASON_SPP_MAX 2
#define LULL_REASON_UNIFORM 3 /* it has the samples that all were to get */
#define LULL_REASON_TIME 4
#define LULL_REASON_INTERRUPT 5
#define LULL_REASON_DROPPED 6 /* the criterion said stop twice, but samples were dropped: not called converged */
#define LULL_REASON_COUNT 7

/* "none", "criterion", "spp-max", …; "unknown" for other numbers. Static text. */
LULL_EXPORT const char *lull_host_reason(int32_t reason);

/* One block. The renderer writes the fields of the second group, the library all others. Never grows. */
struct lull_host_block {
    uint32_t id;            /* place in the whole picture's grid, row by row; in a layout of one's own the index */
    int32_t x0, y0, x1, y1; /* pixels, end exclusive */
    int32_t reason;         /* LULL_REASON_ */

    uint64_t spp, half_spp; /* samples per pixel so far, and those of them in HALF, without which criteria of halves never
                             * stop a block: a check where it is 0 or spp in all blocks warns once */
    double thread_s;        /* thread seconds spent on it; NaN: not known */
    uint64_t rays;          /* the renderer's own count; not read */
    uint64_t dropped;       /* samples, of all its pixels, that were left out for a value that is not finite */

    uint64_t next_spp;                    /* where the next check is: > spp while the block is to be rendered */
    uint64_t asked_spp;                   /* samples at the last answer */
    double p_noisy, error, predicted_spp; /* of the last answer; NaN: not known */
    uint32_t asked;                       /* there is an answer */
    uint32_t checks;
    uint32_t stop_votes; /* STOP answers in a row */
    uint32_t step;       /* of the mask, in eighths: its quality parameter is scaled by 4^(-step / 8) */
};

/* The blocks of a frame and their limits. Made by the library; tests make some by hand. */
struct lull_host_blocks {
    uint32_t struct_size;
    uint32_t count;
    struct lull_host_block *list; /* owned by the frame; the index is the block's id for the criterion */
    uint32_t columns, rows;       /* of the whole picture's grid; 0: a layout of one's own */
    uint32_t list_columns;        /* of the part that is in the list, which is a rectangle of blocks */
    uint32_t flags;               /* LULL_HOST_UNIFORM, LULL_HOST_OPEN_ENDED */
    int32_t block_width, block_height;
    int32_t x0, y0, x1, y1; /* the smallest rectangle that holds them */
    uint64_t spp_min, spp_max, check_step;
};

/* Sums over the frame. The renderer adds to those of the first line, the library to the others. */
struct lull_host_totals {
    uint64_t samples, paths, rays, dropped;
    double render_s, criterion_s; /* wall seconds of rendering, which the renderer adds up, and of the checks */
    uint64_t checks, failed_checks, skipped_checks;
    double criterion_thread_s; /* processor seconds of the checks of this process, with those of its denoiser */
    uint64_t asked;            /* blocks that these were about */
};

/* Lays out the blocks and opens the criterion's frame. criterion: borrowed until end; NULL: no criterion is asked (UNIFORM).
 * LULL_E_UNSUPPORTED when it judges blocks of another size only, LULL_E_INVALID for anything that makes no sense. */
LULL_EXPORT int32_t lull_host_begin(const struct lull_host_config *config, struct lull_host_criterion *criterion,
                                    struct lull_host_frame **out, struct lull_error *err);
/* Frees the frame; NULL is allowed. The criterion keeps its own history until its next frame, or until it is closed. */
LULL_EXPORT void lull_host_end(struct lull_host_frame *frame);

/* Borrowed until end; the list stays where it is. */
LULL_EXPORT struct lull_host_blocks *lull_host_blocks_of(struct lull_host_frame *frame);
LULL_EXPORT struct lull_host_totals *lull_host_totals_of(struct lull_host_frame *frame);

/* --- schedule ------------------------------------------------------------------------------------------------------- */

/* Number of blocks that still get samples. */
LULL_EXPORT uint32_t lull_host_active(const struct lull_host_blocks *blocks);
/* Wall seconds of rendering and checks together; compared with the time budget by the second. */
LULL_EXPORT double lull_host_elapsed_s(const struct lull_host_frame *frame);
LULL_EXPORT int32_t lull_host_out_of_time(const struct lull_host_frame *frame);

/* Re-opens stopped blocks beside one that has more than max_seam times their samples, up to the check at that ratio, so that
 * no edge in noise level shows. Returns how many. */
LULL_EXPORT uint32_t lull_host_reopen(struct lull_host_blocks *blocks, double max_seam);

/* After a state was loaded into a frame with other limits: blocks that a limit or an interrupt had closed are active again
 * as far as the limits allow. Returns how many. */
LULL_EXPORT uint32_t lull_host_extend(struct lull_host_blocks *blocks);

/* The pixels at this moment, borrowed for the call that gets them. */
struct lull_host_view {
    uint32_t struct_size;
    uint32_t plane_count;
    int32_t x0, y0, x1, y1;          /* the pixels that the planes hold, all blocks among them */
    const struct lull_plane *planes; /* [plane_count], index LULL_PLANE_. SPP and WEIGHT are made by the library where a
                                      * criterion requires one and the view has none; SPP serves as WEIGHT, too, so that
                                      * sums of pixels with samples of their own are of LULL_NORM_WEIGHT */
    /* Samples left out of each pixel, for values that are not finite (u32, LULL_NORM_ONE); NULL: none. dropped belongs to
     * COLOR and MOMENT2, dropped_half to HALF; they are read where a block has `dropped`, and sums (LULL_NORM_SPP, HALF_SPP)
     * are then divided by the samples that are in them; so are those of LULL_NORM_WEIGHT (the scale of HALF being that of
     * samples to those in HALF). Not together with a plane WEIGHT. */
    const struct lull_plane *dropped;
    const struct lull_plane *dropped_half;
};

/* To be called when every active block is at its next_spp (open-ended: or at spp_max). Asks about them, stops or
 * schedules each, and re-opens blocks if the config says so. When the criterion fails its error is returned, and all
 * blocks go on. */
LULL_EXPORT int32_t lull_host_check(struct lull_host_frame *frame, const struct lull_host_view *view,
                                    struct lull_error *err);

/* Closes the blocks that are still active with a reason (time, interrupt). They get no more samples; the criterion is asked
 * once more about them, for the report, unless view is NULL. */
LULL_EXPORT int32_t lull_host_stop(struct lull_host_frame *frame, int32_t reason, const struct lull_host_view *view,
                                   struct lull_error *err);

/* --- ask: the parts of lull_host_check, for renderers with a way of their own ----------------------------------------- */

/* Lists the blocks to be asked about, rising, and which of them get no more samples: due and final have room for every
 * block. Blocks whose check is left out are scheduled on. Returns how many; 0: there is no question. */
LULL_EXPORT uint32_t lull_host_due(struct lull_host_frame *frame, uint32_t *due, uint8_t *final);

/* Asks any criterion that was opened for the frame about blocks list[due[0 … count)], rising; nothing is noted. Each
 * decision is preset to go on, and is so after a failure. final may be NULL. */
LULL_EXPORT int32_t lull_host_evaluate(struct lull_host_criterion *criterion, const struct lull_host_frame *frame,
                                       const struct lull_host_view *view, const uint32_t *due, const uint8_t *final,
                                       uint32_t count, struct lull_decision *decisions, struct lull_error *err);

/* The same of the frame's own criterion, timed and counted in the totals. */
LULL_EXPORT int32_t lull_host_ask(struct lull_host_frame *frame, const struct lull_host_view *view, const uint32_t *due,
                                  const uint8_t *final, uint32_t count, struct lull_decision *decisions,
                                  struct lull_error *err);

/* Notes answers with their blocks. lull_host_apply also stops or schedules each. A block that dropped samples stops at the
 * second STOP in a row. */
LULL_EXPORT void lull_host_note(struct lull_host_frame *frame, const uint32_t *due, uint32_t count,
                                const struct lull_decision *decisions);
LULL_EXPORT void lull_host_apply(struct lull_host_frame *frame, const uint32_t *due, uint32_t count,
                                 const struct lull_decision *decisions);

/* --- mask ----------------------------------------------------------------------------------------------------------- */

/* The factor of the criterion's quality parameter for lull_host_block.step, 1 for step 0. */
LULL_EXPORT double lull_host_mask_factor(uint32_t step);

/* --- report --------------------------------------------------------------------------------------------------------- */

#define LULL_REPORT_INTERRUPTED UINT32_C(1)
#define LULL_REPORT_MESSAGES UINT32_C(2) /* messages, message_bytes, message_wait_s are known */
#define LULL_REPORT_NO_RAYS UINT32_C(4)  /* rays are not counted */
#define LULL_REPORT_DENOISED UINT32_C(8) /* the picture is denoised: noisy_weight and noisy_error */

/* What wall seconds went to. */
struct lull_host_phase {
    const char *name; /* "samples" … */
    double seconds;
};

/* What the library cannot know. Text may be NULL: null in the report. */
struct lull_host_report {
    uint32_t struct_size;
    uint32_t flags;                    /* LULL_REPORT_ */
    const char *scene, *mask, *kernel; /* paths; name of the code that sampled */
    const char *const *effects;        /* [effect_count] that the scene calls for */
    uint32_t effect_count;
    uint32_t threads, processes; /* of all processes */
    uint32_t zero;
    uint64_t messages, message_bytes; /* between the processes */
    double message_wait_s;
    uint64_t film_bytes, film_pixels;
    double scene_bytes; /* NaN: not known */

    /* With LULL_REPORT_DENOISED: the share of the noisy picture in it, over all pixels, and the error of the noisy picture,
     * [blocks], NULL: not known. */
    double noisy_weight;
    const double *noisy_error;

    /* Since 1.1: where it was made; NULL: not known. */
    const char *software, *processor; /* the renderer with its version */
    const char *const *command;       /* [command_count] words of the command line */
    uint64_t command_count;

    /* Since 1.2: where the renderer's time went, [phase_count]. */
    const struct lull_host_phase *phases;
    uint64_t phase_count;
};

/* The report as JSON (lull-render(1) says what is in it): to a file, replaced as a whole or not at all, or to a writer. */
LULL_EXPORT int32_t lull_host_report_write(const struct lull_host_frame *frame, const struct lull_host_report *report,
                                           const char *path, struct lull_error *err);
LULL_EXPORT int32_t lull_host_report_text(const struct lull_host_frame *frame, const struct lull_host_report *report,
                                          const struct lull_writer *writer, struct lull_error *err);

/* --- stop map ------------------------------------------------------------------------------------------------------- */

/* Writes where blocks stopped: with the ending .csv one line "NAME;spp;spp;…;", NAME being that of the file `scene`; else a
 * PNG with each block in the colour of its count, the count in it, and a legend. The file is replaced as a whole or not at
 * all. */
LULL_EXPORT int32_t lull_host_stop_map(const struct lull_host_blocks *blocks, const char *path, const char *scene,
                                       struct lull_error *err);

/* --- state ---------------------------------------------------------------------------------------------------------- */

/* Blocks, totals, dropped samples and the criterion's history as bytes, for a checkpoint beside the renderer's own sums.
 * Byte order and number formats are those of the machine. */
LULL_EXPORT int32_t lull_host_save(const struct lull_host_frame *frame, const struct lull_writer *writer,
                                   struct lull_error *err);
/* Into a frame that was begun like the saved one, the limits aside. Nothing is believed of the bytes; a
 * refused state (LULL_E_IO) changes nothing in the frame. name: of the file, for messages. */
LULL_EXPORT int32_t lull_host_load(struct lull_host_frame *frame, const void *data, uint64_t size, const char *name,
                                   struct lull_error *err);
/* What a picture depends on, as lines "key=value\n", is kept beside a state; this compares the saved text (of saved_size
 * bytes) with the present one, key by key whatever the order, and names the first difference (LULL_E_VALUE). A key may stand
 * more than once. */
LULL_EXPORT int32_t lull_host_same_identity(const char *saved, uint64_t saved_size, const char *present, const char *name,
                                            struct lull_error *err);

#ifdef __cplusplus
}
#endif

#endif
