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
 * Numbers.  The same samples give the same decisions whatever the order in which blocks and threads finish.
 */
#ifndef LULL_HOST_H
#define LULL_HOST_H

#include <lull/criterion.h>
#include <lull/loader.h>

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
    double time_budget_s;      /* seconds that rendering and checks may take together; 0: any */
    double max_check_overhead; /* share of these seconds that checks may take; 0: any. Others are left out */
    double max_seam;           /* most ratio of samples of neighbouring blocks, at least 1; 0: any (lull_host_reopen) */
    uint64_t check_step;       /* checks stand at multiples of so many samples, or at spp_max; 0 reads as 1 */

    /* A grey plane of the whole picture in [0, 1] (f32 or f64, 1 channel, LULL_NORM_ONE), read by lull_host_begin; NULL:
     * none. White takes a quarter of the criterion's quality parameter, which is `visible` if that has a value, else
     * `threshold`; black leaves it, grey g takes 4^-g of it, in steps of an eighth. The lightest pixel of a block counts. */
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
/* Opens the frame for one more criterion, which can then be asked by lull_host_evaluate. A criterion has one frame, the one
 * that was opened last: it answers about no other. */
LULL_EXPORT int32_t lull_host_join(const struct lull_host_frame *frame, struct lull_host_criterion *criterion,
                                   struct lull_error *err);
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

/* The sample count of the check after one at spp: `asked` when the criterion named one, else a geometric step. */
LULL_EXPORT uint64_t lull_host_next_check(const struct lull_host_blocks *blocks, uint64_t spp, uint64_t asked);

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

/* The decision where no criterion was asked: go on. */
LULL_EXPORT struct lull_decision lull_host_undecided(void);

/* --- mask ----------------------------------------------------------------------------------------------------------- */

/* The factor of the criterion's quality parameter for lull_host_block.step, 1 for step 0. */
LULL_EXPORT double lull_host_mask_factor(uint32_t step);

/* --- forecast -------------------------------------------------------------------------------------------------------- */

/* What a criterion said about a block last. Never grows, as all structs here. */
struct lull_host_said {
    uint64_t spp;     /* samples when it was asked; 0: it never was */
    double predicted; /* samples at which it expects to stop; NaN: it does not say */
    int32_t stopped;  /* it said stop: `predicted` is where, at most spp */
    int32_t unmet;    /* its noise sits in few pixels or grows: light that most of its pixels have not met yet */
};

/* Where a block is expected to stop. */
struct lull_host_stop_at {
    double spp;       /* samples per pixel */
    double low, high; /* 8 of 10 blocks stop between them */
    int64_t known;    /* 0: there is no prediction; spp and high are spp_max, low is what the block has */
};

/* Predictions are taken as they are: from a hundred samples on they were neither low nor high (docs/quote.md). The interval
 * widens with the octaves from the samples at hand to the predicted ones, and to an octave either way for a block that is
 * `unmet`. It does not stop before `spp`: samples that it has or gets in any case, 0 … spp_max. */
LULL_EXPORT struct lull_host_stop_at lull_host_expect(const struct lull_host_said *said, uint64_t spp, uint64_t spp_max);
/* Of a block of a render that is going on. A stopped block: where it did. */
LULL_EXPORT struct lull_host_stop_at lull_host_expect_block(const struct lull_host_blocks *blocks,
                                                            const struct lull_host_block *block);
/* More checks of a block that stops at `spp`: as many per octave as the criterion asks for now. */
LULL_EXPORT double lull_host_expect_checks(const struct lull_host_block *block, double spp);

/* Work that is left in one block, whose samples all cost the same. */
struct lull_host_work {
    double spp;      /* more samples per pixel, >= 0 */
    double thread_s; /* for all of them */
    int64_t rows;    /* of pixels: what threads share a block by */
};

/* Wall seconds of `count` blocks sampled side by side, each until it has its samples: a block's rows are all that can be
 * done at once, so the last blocks leave threads idle. Sorts `work`. threads >= 1; as many processors are taken to be
 * free. */
LULL_EXPORT double lull_host_wall_s(struct lull_host_work *work, uint32_t count, int32_t threads);
/* Threads that are busy while this many rows are to be done. */
LULL_EXPORT double lull_host_busy(int64_t rows, int32_t threads);

/* The whole frame. */
struct lull_host_forecast {
    double done_s, left_s;      /* thread seconds of sampling, spent and to come */
    double sampling_s, check_s; /* wall seconds to come, on free processors; checks as dear as those before */
    uint64_t low, high;         /* samples of the active blocks; low > high: there is none */
    uint32_t active;            /* blocks */
    uint32_t known;             /* every active block has a prediction: else all of it is at most */
};
LULL_EXPORT int32_t lull_host_forecast_of(const struct lull_host_blocks *blocks, const struct lull_host_totals *totals,
                                          int32_t threads, struct lull_host_forecast *out, struct lull_error *err);

/* A line for people: share done, active blocks, their range of samples, speed, time left. left_s: wall seconds to come if
 * the time budget (0: any) does not end the render before, INFINITY: not known. *percent: what the line before said, at
 * first 0: the share never falls. What only a bound is known of says so: without predictions of the criterion the share is a
 * lower one ("?" below 1 %), the time an upper one. */
LULL_EXPORT void lull_host_progress(const struct lull_host_blocks *blocks, const struct lull_host_totals *totals,
                                    const struct lull_host_forecast *forecast, double time_budget_s, double left_s,
                                    double samples_per_s, double *percent, char *text, uint64_t room);

/* --- quote ----------------------------------------------------------------------------------------------------------- */

/* What accuracy will cost, told from the first checks of a render (its pilot). Each row is one more instance of the frame's
 * criterion, most with another value of a parameter, that is asked about the blocks as they are. Neither the frame nor its
 * own criterion changes: the render can go on as if there had been no quote. It borrows the frame, and ends before the
 * frame's criterion is closed. */
struct lull_host_quote;

struct lull_host_quote_block {
    struct lull_host_stop_at stop;
    double thread_s, thread_low_s, thread_high_s; /* of sampling up to there, and to the ends of the interval */
    double sample_s; /* of one sample of every pixel; where there is no sample yet that of the other blocks' pixels */
    int64_t unmet;   /* as in lull_host_said */
};

struct lull_host_quote_row {
    const struct lull_host_quote_block *blocks; /* of the frame, by index; the quote's */
    double spp_min, spp_mean, spp_max;          /* samples per pixel: least block, all pixels, dearest block */
    double spp_mean_low, spp_mean_high;
    double thread_s, thread_low_s, thread_high_s; /* of sampling, the whole picture from its start */
    double wall_s, wall_low_s, wall_high_s;       /* with the checks, on free processors */
    double against_uniform;                       /* samples over those of the dearest block everywhere */
    uint32_t unknown, unmet, capped; /* blocks without a prediction; without their light yet; that reach spp_max */
    int32_t asked;                   /* this is the render that is going on */
};

/* A quote without rows. threads: that the renderer samples with, at least 1. */
LULL_EXPORT int32_t lull_host_quote_begin(const struct lull_host_frame *frame, int32_t threads, struct lull_host_quote **out,
                                          struct lull_error *err);
LULL_EXPORT void lull_host_quote_end(struct lull_host_quote *quote);

/* One more row: an instance like the frame's criterion, with this parameter after those that it has; NULL: like it, or
 * nothing where the frame has none. asked: it stands for the render itself, whose own stops and checks are followed. */
LULL_EXPORT int32_t lull_host_quote_add(struct lull_host_quote *quote, const struct lull_pair *changed, int32_t asked,
                                        struct lull_error *err);
/* One more row: any other criterion, which is the quote's from now on, even after a failure. */
LULL_EXPORT int32_t lull_host_quote_add_other(struct lull_host_quote *quote, struct lull_host_criterion *criterion,
                                              struct lull_error *err);

/* May be called at each check of the pilot, with its blocks, rising: stops between two checks are then known. A row whose
 * criterion fails keeps what it knew. */
LULL_EXPORT void lull_host_quote_ask(struct lull_host_quote *quote, const struct lull_host_view *view, const uint32_t *due,
                                     uint32_t count);
/* Asks about every block that has samples, and works out the rows, in the order in which they were added; the quote's. After
 * a failure the quote can only end. */
LULL_EXPORT int32_t lull_host_quote_finish(struct lull_host_quote *quote, const struct lull_host_view *view,
                                           const struct lull_host_quote_row **rows, uint32_t *count, struct lull_error *err);

/* --- report --------------------------------------------------------------------------------------------------------- */

/* A dropped sample, so that its path can be replayed. The frame keeps the first LULL_HOST_DROPPED_KEPT for the report. */
struct lull_host_sample {
    uint32_t x, y, sample;
};
#define LULL_HOST_DROPPED_KEPT 16
LULL_EXPORT void lull_host_drop(struct lull_host_frame *frame, uint32_t x, uint32_t y, uint32_t sample);
/* Those that are kept, in no particular order; borrowed until end. */
LULL_EXPORT const struct lull_host_sample *lull_host_dropped(const struct lull_host_frame *frame, uint32_t *count);

#define LULL_REPORT_INTERRUPTED UINT32_C(1)
#define LULL_REPORT_MESSAGES UINT32_C(2) /* messages, message_bytes, message_wait_s are known */
#define LULL_REPORT_NO_RAYS UINT32_C(4)  /* rays are not counted */
#define LULL_REPORT_DENOISED UINT32_C(8) /* the picture is denoised: noisy_weight and noisy_error */

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
};

/* The report as JSON (lull-render(1) says what is in it): to a file, replaced as a whole or not at all, or to a writer. */
LULL_EXPORT int32_t lull_host_report_write(const struct lull_host_frame *frame, const struct lull_host_report *report,
                                           const char *path, struct lull_error *err);
LULL_EXPORT int32_t lull_host_report_text(const struct lull_host_frame *frame, const struct lull_host_report *report,
                                          const struct lull_writer *writer, struct lull_error *err);

/* One picture of a page. rgb: [height][width][3] sRGB codes, row by row from the top. */
struct lull_host_layer {
    const char *name; /* "picture" is what is kept; "noisy", "denoised" and others are compared with it */
    const uint8_t *rgb;
};

/* The report as a page for people, since 1.1: one HTML file, replaced as a whole or not at all, that needs no other and no
 * network. report: the JSON of above, of any age. quote: what lull-render --quote --json printed before, compared with what
 * became of it; NULL: nothing. layers may be none; all have the size of the report's crop, or of its picture where it has
 * none. Nothing is believed of either text. LULL_E_INVALID when one is no such JSON or a size differs. */
LULL_EXPORT int32_t lull_host_page(const char *report, const char *quote, const struct lull_host_layer *layers,
                                   uint32_t layer_count, uint32_t width, uint32_t height, const char *path,
                                   struct lull_error *err);

/* --- stop map ------------------------------------------------------------------------------------------------------- */

/* Writes where blocks stopped: with the ending .csv one line "NAME;spp;spp;…;", NAME being that of the file `scene`; else a
 * PNG with each block in the colour of its count, the count in it, and a legend. The file is replaced as a whole or not at
 * all. */
LULL_EXPORT int32_t lull_host_stop_map(const struct lull_host_blocks *blocks, const char *path, const char *scene,
                                       struct lull_error *err);
/* The picture for any numbers, values[count] >= 0, in a unit for the legend: integers and what is above 99 are written
 * whole, others with two digits. */
LULL_EXPORT int32_t lull_host_value_map(const struct lull_host_blocks *blocks, const double *values, const char *unit,
                                        const char *path, struct lull_error *err);
/* Colour of t in [0, 1] (clamped), dark blue to yellow, perceptually uniform. */
LULL_EXPORT void lull_host_viridis(double t, uint8_t rgb[3]);

/* --- the denoised picture ------------------------------------------------------------------------------------------- */

/* The denoised picture alone; else a blend of it with the noisy one, which needs HALF. */
#define LULL_DENOISE_FULL UINT32_C(1)

struct lull_host_denoising {
    uint32_t struct_size;
    uint32_t flags;   /* LULL_DENOISE_ */
    uint32_t threads; /* 0: all processors */
    uint32_t zero;
    const char *library; /* Open Image Denoise, or a folder that holds it; NULL: LULL_OIDN and the usual places */
    void *context;       /* of cancelled */
    int (*cancelled)(void *context); /* asked while it works; not 0: it ends with LULL_E_INVALID. May be NULL */
};

/* Pictures over the pixels of the view, row by row from the top, the caller's. */
struct lull_host_picture {
    uint32_t struct_size;
    uint32_t zero;
    float *rgb;      /* [height][width][3]: what is kept */
    float *denoised; /* [height][width][3]: for the blend the mean of the denoised halves; may be NULL */
    float *weight;   /* [height][width], in [0, 1]: share of the noisy picture in rgb; may be NULL */
};

/* Denoises the picture of a frame at any moment, by Open Image Denoise in a process of its own; with the planes ALBEDO and
 * NORMAL, if the view has them. For the blend, each half of the samples is denoised by itself and the two are averaged:
 * their difference then tells the error of just this picture, by which the blend weighs it against the noisy one at each
 * pixel; where there are no halves it is the denoised picture. Pixels without samples are black. LULL_E_INVALID: no library,
 * one that fails, or a view that lacks a plane; out is undefined then. Takes 180 bytes a pixel, the denoiser some 600
 * more. */
LULL_EXPORT int32_t lull_host_denoise(const struct lull_host_frame *frame, const struct lull_host_view *view,
                                      const struct lull_host_denoising *how, const struct lull_host_picture *out,
                                      struct lull_error *err);
/* Whether there is a library; the error says how to get one. */
LULL_EXPORT int32_t lull_host_denoiser(const char *library, struct lull_error *err);

/* --- the live view (1.1) ---------------------------------------------------------------------------------------------- */

/* Shows the picture in an image viewer while it is made: noisy R, G, B and lull.spp, lull.p_noisy, lull.error, and a frame
 * around each block, bright while it is active, thin with its samples when it has stopped. A thread of its own speaks the
 * protocol of tev, which HDRView and others know too. It never holds the renderer: what a slow viewer does not take in time
 * is replaced by what is newer, a viewer that is gone is looked for again every second, and one that comes late gets all.
 * Takes 12 bytes a pixel. */
struct lull_host_display;

/* address: "HOST", "HOST:PORT" or "[IPv6]:PORT"; the port is 14158 where none is named. May wait for a name server; whether
 * there is a viewer makes no difference. name: of the image in the viewer, copied. frame: borrowed until close. */
LULL_EXPORT int32_t lull_host_display_open(const struct lull_host_frame *frame, const char *address, const char *name,
                                           struct lull_host_display **out, struct lull_error *err);
/* To be called between samples, as often as one likes: copies the pixels of blocks that have changed if there is a viewer,
 * at most every quarter of a second, and so that it takes at most a fiftieth of the time. The view needs the plane COLOR. */
LULL_EXPORT int32_t lull_host_display_update(struct lull_host_display *display, const struct lull_host_view *view,
                                             struct lull_error *err);
/* Sends the last picture, NULL: the one copied last, as long as the viewer takes it and for two seconds at most. Returns 1
 * if it did, else 0; frees the display, which may be NULL. */
LULL_EXPORT int32_t lull_host_display_close(struct lull_host_display *display, const struct lull_host_view *view);

/* --- files: for renderers without such functions of their own --------------------------------------------------------- */

/* A file that will be written. option: what asked for it, a long option without its dashes, for messages. */
struct lull_host_output {
    const char *option, *path;
};

/* To be called before the work. Each can be written, no two are one file, and none is one of the inputs (files that are
 * there): whatever they are called, through links too. LULL_E_IO or LULL_E_INVALID for the first that is not so. What
 * killed processes left of such files is removed. At most 24 outputs. */
LULL_EXPORT int32_t lull_host_check_outputs(const struct lull_host_output *outputs, uint32_t output_count,
                                            const char *const *inputs, uint32_t input_count, struct lull_error *err);

/* A file that becomes `path` when it is complete and on the disk, or never: what was there before stays until then. Write to
 * *descriptor, which stays the file's. Commit and abort free the file; a commit that fails keeps the old one. */
struct lull_host_file;
LULL_EXPORT int32_t lull_host_file_begin(const char *path, struct lull_host_file **out, int32_t *descriptor,
                                         struct lull_error *err);
LULL_EXPORT int32_t lull_host_file_commit(struct lull_host_file *file, struct lull_error *err);
LULL_EXPORT void lull_host_file_abort(struct lull_host_file *file);

/* 8-bit sRGB codes (IEC 61966-2-1), the same on every processor: codes[i] of the linear value linear[i]; 0 for NaN. */
LULL_EXPORT void lull_host_srgb(const double *linear, uint64_t count, uint8_t *codes);
/* Writes such codes, rgb[height][width][3], as a PNG, which is replaced as a whole or not at all. */
LULL_EXPORT int32_t lull_host_write_png(const char *path, uint32_t width, uint32_t height, const uint8_t *rgb,
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
/* The same without the criterion's history, which it may not understand when its parameters are others. */
LULL_EXPORT int32_t lull_host_load_blocks(struct lull_host_frame *frame, const void *data, uint64_t size, const char *name,
                                          struct lull_error *err);
/* Only the criterion's history. */
LULL_EXPORT int32_t lull_host_save_history(const struct lull_host_criterion *criterion, const struct lull_writer *writer,
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
