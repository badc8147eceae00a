/* SPDX-License-Identifier: MIT
 *
 * lull/host_draft.h - more of the host library, not frozen: forecast, quote, page, denoised picture, live view, files.
 *
 * What is here works as lull/host.h says and is in the same library, but a minor version may change it: a renderer that
 * uses it is built with the version that it runs with. What proves itself moves to lull/host.h.
 */
#ifndef LULL_HOST_DRAFT_H
#define LULL_HOST_DRAFT_H

#include <lull/host.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- one more criterion ----------------------------------------------------------------------------------------------- */

/* Opens the frame for one more criterion, which can then be asked by lull_host_evaluate. A criterion has one frame, the one
 * that was opened last: it answers about no other. */
LULL_EXPORT int32_t lull_host_join(const struct lull_host_frame *frame, struct lull_host_criterion *criterion,
                                   struct lull_error *err);
/* The parameter that says how good blocks are to be, which a mask scales and a quote varies: the first of `error`, `visible`
 * and `threshold` that pairs or the table set to a number in its range; NULL: there is none. value: may be NULL. */
LULL_EXPORT const struct lull_param *lull_host_quality(const struct lull_criterion *table, const struct lull_pair *pairs,
                                                       uint32_t pair_count, double *value);

/* --- forecast -------------------------------------------------------------------------------------------------------- */

/* Where a block is expected to stop. */
struct lull_host_stop_at {
    double spp;       /* samples per pixel */
    double low, high; /* 8 of 10 blocks stop between them */
    int64_t known;    /* 0: there is no prediction; spp and high are spp_max, low is what the block has */
};

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
    int64_t unmet;   /* its noise sits in few pixels or grows: light that most of its pixels have not met yet */
};

struct lull_host_quote_row {
    const struct lull_host_quote_block *blocks; /* of the frame, by index; the quote's */
    double spp_min, spp_mean, spp_max;          /* samples per pixel: least block, all pixels, dearest block */
    double spp_mean_low, spp_mean_high;
    double thread_s, thread_low_s, thread_high_s; /* of sampling, the whole picture from its start */
    double wall_s, wall_low_s, wall_high_s;       /* with the checks, on free processors */
    double against_uniform;                       /* samples over those of the most expensive block everywhere */
    uint32_t unknown, unmet, capped; /* blocks without a prediction; without their light yet; that reach spp_max */
    int32_t asked;                   /* this is the render that is going on */
    const char *parameter; /* what lull_host_quote_usual sets in this row; static text, NULL: nothing, or another row */
    double value;
    const char *name; /* static text: "rough", "draft", "good", "default", "strict", "as asked"; NULL: another row */
    int64_t told;     /* 0: the pilot has met too little: the numbers are not to be believed */
};

/* A quote without rows. threads: that the renderer samples with, at least 1. */
LULL_EXPORT int32_t lull_host_quote_begin(const struct lull_host_frame *frame, int32_t threads, struct lull_host_quote **out,
                                          struct lull_error *err);
LULL_EXPORT void lull_host_quote_end(struct lull_host_quote *quote);

/* One more row: an instance like the frame's criterion, with this parameter after those that it has; NULL: like it, or
 * nothing where the frame has none. asked: it stands for the render itself, whose own stops and checks are followed. */
LULL_EXPORT int32_t lull_host_quote_add(struct lull_host_quote *quote, const struct lull_pair *changed, int32_t asked,
                                        struct lull_error *err);
/* One more row: the render's criterion, stopped at an error of `limit` > 0, told from the errors that the row which stands
 * for the render is answered (lull_decision.error). No instance of its own, so nothing is asked twice. */
LULL_EXPORT int32_t lull_host_quote_add_error(struct lull_host_quote *quote, double limit, struct lull_error *err);
/* One more row: any other criterion, which is the quote's from now on, even after a failure. */
LULL_EXPORT int32_t lull_host_quote_add_other(struct lull_host_quote *quote, struct lull_host_criterion *criterion,
                                              struct lull_error *err);

/* Rows that people compare, coarse to fine, with parameter, value and name. Where the criterion has `error`: 8, 4 and 2
 * times what is just seen; where that is set, 1, 0.5 and the value itself, too. Else, of `visible`, 0.5 (where there is no
 * `error`), the criterion's default (0.25 if it names none), 0.05 and the value itself; of `threshold` four times, twice and
 * once the value; values that the criterion's table excludes have no row. The render itself always has one, "as asked" if it
 * is none of these. noisy: NULL, or the criterion that judges the noisy picture: where the frame's criterion is `denoised`,
 * rows are those of coarser errors, the render, "denoised", and "noisy". */
LULL_EXPORT int32_t lull_host_quote_usual(struct lull_host_quote *quote, const struct lull_criterion *noisy,
                                          struct lull_error *err);

/* May be called at each check of the pilot, with its blocks, rising: stops between two checks are then known. A row whose
 * criterion fails keeps what it knew. */
LULL_EXPORT void lull_host_quote_ask(struct lull_host_quote *quote, const struct lull_host_view *view, const uint32_t *due,
                                     uint32_t count);
/* Asks about every block that has samples, and works out the rows, in the order in which they were added; the quote's. After
 * a failure the quote can only end. */
LULL_EXPORT int32_t lull_host_quote_finish(struct lull_host_quote *quote, const struct lull_host_view *view,
                                           const struct lull_host_quote_row **rows, uint32_t *count, struct lull_error *err);

/* Samples that a block of a frame between two quotes of a moving picture gets, of `count` blocks in rows of `columns`: the
 * larger of its two needs; where something moves in it or beside it, half of the octaves from there to the largest need of
 * what moves. A block moves when its need changes by more than the quotes' intervals allow. a, b: [count]. */
LULL_EXPORT uint32_t lull_host_quote_between(const struct lull_host_quote_block *a, const struct lull_host_quote_block *b,
                                             uint32_t count, uint32_t columns, uint32_t block);
/* Raises the samples of a frame's blocks, [count], to at most a quarter of an octave below those of the frame beside it, so
 * that noise fades instead of jumping. */
LULL_EXPORT void lull_host_quote_fade(uint32_t *spp, const uint32_t *beside, uint32_t count);

/* --- dropped samples ------------------------------------------------------------------------------------------------- */

/* A dropped sample, so that its path can be replayed. The frame keeps the first LULL_HOST_DROPPED_KEPT for the report. */
struct lull_host_sample {
    uint32_t x, y, sample;
};
#define LULL_HOST_DROPPED_KEPT 16
LULL_EXPORT void lull_host_drop(struct lull_host_frame *frame, uint32_t x, uint32_t y, uint32_t sample);
/* Those that are kept, in no particular order; borrowed until end. */
LULL_EXPORT const struct lull_host_sample *lull_host_dropped(const struct lull_host_frame *frame, uint32_t *count);

/* --- more pictures of a frame ---------------------------------------------------------------------------------------- */

/* The picture for any numbers, values[count] >= 0, in a unit for the legend: integers and what is above 99 are written
 * whole, others with two digits. */
LULL_EXPORT int32_t lull_host_value_map(const struct lull_host_blocks *blocks, const double *values, const char *unit,
                                        const char *path, struct lull_error *err);

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
 * pixel; where there are no halves it is the denoised picture. Both are denoised once more with denoised ALBEDO and NORMAL,
 * unless it is a draft that is done: the criterion has stopped every block, one of them with an error above 1. Pixels
 * without samples are black. LULL_E_INVALID: no library, one that fails, or a view that lacks a plane; out is undefined
 * then. Takes 180 bytes a pixel, the denoiser some 600 more. */
LULL_EXPORT int32_t lull_host_denoise(const struct lull_host_frame *frame, const struct lull_host_view *view,
                                      const struct lull_host_denoising *how, const struct lull_host_picture *out,
                                      struct lull_error *err);
/* Whether there is a library; the error says how to get one. */
LULL_EXPORT int32_t lull_host_denoiser(const char *library, struct lull_error *err);

/* --- the live view, since 1.1 ----------------------------------------------------------------------------------------- */

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
/* What a display shows of an image file of any format that Lull's programs read, as such codes, all at once: of its picture
 * (layer NULL), or of the light in the channels LAYER.R, LAYER.G and LAYER.B. needed: a channel without which the file is
 * refused, or NULL. LULL_E_IO where neither the library nor the program has lull/modules/lull-images.so beside it. */
LULL_EXPORT int32_t lull_host_read_shown(const char *path, const char *layer, const char *needed, uint32_t *width,
                                         uint32_t *height, const struct lull_writer *rgb, struct lull_error *err);

/* --- parts of a state ------------------------------------------------------------------------------------------------ */

/* The same without the criterion's history, which it may not understand when its parameters are others. */
LULL_EXPORT int32_t lull_host_load_blocks(struct lull_host_frame *frame, const void *data, uint64_t size, const char *name,
                                          struct lull_error *err);
/* Only the criterion's history. */
LULL_EXPORT int32_t lull_host_save_history(const struct lull_host_criterion *criterion, const struct lull_writer *writer,
                                           struct lull_error *err);

/* --- replay --------------------------------------------------------------------------------------------------------- */

/* Since 1.2: pixels of a block that were recorded at `spp` samples, as they would be shown at to_spp > spp. The mean stays,
 * its noise falls: HALF differs from it by less, as 1/sqrt(samples), and is of to_spp / 2 samples; MOMENT2 is of the same
 * variance of a sample. For criteria that read no other planes. Light that no sample has met is not in them. */
struct lull_host_simulation {
    uint32_t struct_size;
    uint32_t zero;
    uint64_t pixels, spp, half_spp, to_spp;
    double rgb_to_xyz[9]; /* all 0: linear sRGB */
    const double *color;  /* [pixels][3] */
    double *half;         /* [pixels][3], replaced; NULL: not there */
    double *moment2;      /* [pixels], likewise */
};

LULL_EXPORT int32_t lull_host_simulate(const struct lull_host_simulation *simulation, struct lull_error *err);

#ifdef __cplusplus
}
#endif

#endif
