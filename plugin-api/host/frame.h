/* What the files of the host library share: an opened criterion and a frame. Private; the interface is lull/host.h. */
#ifndef LULL_HOST_FRAME_H
#define LULL_HOST_FRAME_H

#include <lull/host_draft.h>

#include <pthread.h>
#include <stdatomic.h>

#include "base/err.h"
#include "base/threads.h"
#include "picture/draw.h"
#include "src/process_state.h"

enum { LULL_HOST_STEPS = 8 }; /* of a mask */
static const uint64_t LULL_HOST_MOST_SPP = INT32_MAX;

/* Planes that the library makes where a criterion requires one of them. */
#define LULL_HOST_COUNTS (LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT))

struct lull_host_frame;

/* Samples that an active block gets before it is asked about again. */
uint64_t lull_host_goal(const struct lull_host_blocks *blocks, const struct lull_host_block *block);

/* Lines of a criterion that are kept, and the characters of one. */
enum { LULL_HOST_MESSAGES = 8, LULL_HOST_LINE = 600 };

struct lull_host_criterion {
    const struct lull_criterion *table;
    struct lull_instance *instances[LULL_HOST_STEPS + 1]; /* own; by step of the mask, NULL where no block is of that step */
    struct lull_pair *pairs;                              /* owns, as their text; [pair_count + 1], the last one free */
    uint32_t pair_count;
    struct lull_requirements needs;
    struct lull_host_services offered; /* name: owns */
    struct base_threads *threads;      /* owns; NULL: the renderer's own, or one */
    struct lull_host host;             /* shows the services to the criterion */

    /* Of its frame, if one is open: scratch of an evaluate, [block_count]. */
    const struct lull_host_frame *frame; /* never followed, only compared; NULL after a failure */
    uint32_t block_count;
    struct lull_block *all;        /* owns, with the next two: the state of every block */
    struct lull_block *due;        /* of those that one instance is asked about */
    struct lull_decision *answers; /* of that instance */
    double begin_s;
    int open;

    /* The first warning, where the services have no log; the LULL_WARNING_ state says what became of it. */
    atomic_int warning_state;
    char warning[LULL_HOST_LINE];

    atomic_int warned_of_change; /* that a call of it changed what is the renderer's */

    /* What was said in its frame, for the report: the first lines of LULL_LOG_INFO or worse. */
    pthread_mutex_t messages_lock;
    uint32_t message_count;
    char messages[LULL_HOST_MESSAGES][LULL_HOST_LINE];
};

enum { LULL_WARNING_NONE, LULL_WARNING_BEING_WRITTEN, LULL_WARNING_WAITING, LULL_WARNING_PASSED };

static inline int lull_host_wants_counts(const struct lull_host_criterion *c)
{
    return (c->needs.planes_required & LULL_HOST_COUNTS) != 0;
}

/* The responses about a block at each check, for the report; of a loaded state from there on. */
struct lull_host_answer {
    uint64_t spp;
    double error, p_noisy;
};

/* Answers of one block that are kept, even; of a full list every second goes. Fewer where there are many blocks. */
enum { LULL_HOST_ANSWERS = 64, LULL_HOST_ANSWERS_IN_ALL = 1 << 22 };

struct lull_host_frame {
    struct lull_host_config config; /* exposure, rgb_to_xyz: what they stand for; layout, mask: NULL, they were read */
    struct lull_host_criterion *criterion; /* borrows; may be NULL */
    struct lull_host_blocks blocks;
    struct lull_host_totals totals;
    struct lull_host_sample dropped[LULL_HOST_DROPPED_KEPT];
    uint32_t dropped_count;
    struct lull_decision *decisions; /* owns, with the next two; [blocks] each: scratch of lull_host_check */
    uint32_t *due;
    uint8_t *final;
    struct lull_host_answer *answers; /* owns; [blocks][answer_room] */
    uint32_t *answer_count;           /* owns; [blocks] */
    uint32_t answer_room;             /* 0: none are kept */
    int warned_halves;                /* that half_spp is never written */
};

/* The last response of a criterion about a block. */
struct lull_host_response {
    uint64_t spp;         /* samples when it was asked; 0: it never was */
    double predicted;     /* samples at which it expects to stop; NaN: it does not say */
    int32_t stopped;      /* its response is stop: `predicted` is where, at most spp */
    int32_t undersampled; /* its noise sits in few pixels or grows: light that most of its pixels have not met yet */
    double error;         /* that it was given; of rows of a quote by error alone */
};

/* What a row says of a block, first and last. */
struct lull_host_responses {
    struct lull_host_response first, last;
};

/* A row, and what it asks. */
struct lull_host_quote_asked {
    struct lull_host_criterion *criterion; /* owns; NULL: nobody is asked */
    struct lull_host_responses *responses; /* owns; [blocks] */
    struct lull_host_quote_block *blocks;  /* owns; the answer */
    double limit;                          /* the error at which a row by error stops; 0: another row */
    uint64_t first_spp;                    /* samples at the first check of such a row */
    int itself;                            /* it stands for the render */
    int other;                             /* not the frame's criterion: its checks take their own time */
    double asked_s;                        /* wall seconds that it was asked */
    uint64_t count;                        /* blocks that it was asked about */
    const char *parameter, *name;          /* of lull_host_quote_usual, as in the row */
    double value;
};

struct lull_host_quote {
    const struct lull_host_frame *frame; /* borrows */
    int32_t threads;
    uint32_t count;
    struct lull_host_quote_asked *asked; /* owns; [count], as the rows */
    struct lull_host_quote_row *rows;    /* owns; the answer */
    double check_s;                      /* wall seconds that the frame's criterion takes for one block */
};

/* --- services.c ----------------------------------------------------------------------------------------------------- */

/* Copies what is offered and makes criterion->host; criterion->table is set. */
int32_t lull_host_offer(struct lull_host_criterion *criterion, const struct lull_host_services *services,
                        struct lull_error *err);
void lull_host_withdraw(struct lull_host_criterion *criterion);
/* A line to the renderer's log, of LULL_LOG_INFO once a frame, and, of this or worse, for the report; the first warning
 * without a log is kept for lull_host_pass_warning. */
void lull_host_say(struct lull_host_criterion *criterion, int32_t level, const char *text);
/* "criterion ID: ", `what` and its message as one line; returns its code. */
int32_t lull_host_blame(const struct lull_host_criterion *criterion, const char *what, int32_t code,
                        const struct lull_error *why, struct lull_error *err);
/* Passes a warning that was logged nowhere to err, once, with the code LULL_OK; returns LULL_OK. */
int32_t lull_host_pass_warning(struct lull_host_criterion *criterion, struct lull_error *err);

/* After a call of a criterion: puts back what it changed of what was read before, such as rounding, signals or the locale,
 * and tells that once. */
void lull_host_leave(struct lull_host_criterion *criterion, const struct lull_process_state *before, const char *call);

/* --- given.c: what the renderer hands in ----------------------------------------------------------------------------- */

/* Pairs of a name and a pointer, NULL at the end: LULL_E_INVALID names the first pointer that is NULL. */
__attribute__((sentinel)) int32_t lull_host_given(struct lull_error *err, ...);
/* A failure of plugin-api/base in the words of the ABI. */
int32_t lull_host_translate(const struct base_err *why, struct lull_error *err);
int32_t lull_host_no_memory(struct lull_error *err, const char *what);
int32_t lull_host_check_pairs(const struct lull_pair *pairs, uint32_t count, struct lull_error *err);
int32_t lull_host_check_services(const struct lull_host_services *services, struct lull_error *err);
/* All of it but size, blocks and mask. */
int32_t lull_host_check_config(const struct lull_host_config *config, const struct lull_host_criterion *criterion,
                               struct lull_error *err);
/* What describes a plane that has data. */
int32_t lull_host_check_plane(const char *name, const struct lull_plane *plane, uint32_t channels, struct lull_error *err);
int32_t lull_host_check_view(const struct lull_host_blocks *blocks, const struct lull_host_view *view,
                             struct lull_error *err);
/* What the renderer writes into blocks and totals. */
int32_t lull_host_check_samples(const struct lull_host_frame *frame, struct lull_error *err);

/* --- grid.c --------------------------------------------------------------------------------------------------------- */

/* The blocks that the config asks for; clip: cut to its crop. needs: for the size of blocks; NULL: nobody is asked. */
int32_t lull_host_lay_out(const struct lull_host_config *config, const struct lull_requirements *needs, int clip,
                          struct lull_host_blocks *out, struct lull_error *err);

/* --- mask.c --------------------------------------------------------------------------------------------------------- */

/* Fills block.step of every block. Pixels that are no numbers are black, others are cut to [0, 1]. */
int32_t lull_host_read_mask(const struct lull_plane *mask, struct lull_host_blocks *blocks, struct lull_error *err);
/* Writes a number as criteria read it: in the form of the C locale, whatever the renderer has set. 0: no memory. */
int lull_host_number(double value, char text[32]);
/* Writes the quality parameter's pair for a step: *pair points to static text and to `value`. */
int32_t lull_host_scale_quality(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                                uint32_t step, char value[32], struct lull_pair *pair, struct lull_error *err);

/* --- view.c --------------------------------------------------------------------------------------------------------- */

/* A renderer's view as a criterion gets it. */
struct lull_host_shown {
    struct lull_view view; /* of the planes here */
    struct lull_plane planes[LULL_PLANE_COUNT];
    uint32_t *spp;    /* owns, as the others; samples of each pixel, NULL: the view has them, or nobody wants them */
    uint32_t *weight; /* samples of each pixel that are in COLOR, NULL: none was dropped */
    double *half;     /* a HALF that makes up for the samples that it lacks, likewise */
};
/* counts: SPP and WEIGHT are made if the view does not have them. */
int32_t lull_host_show(const struct lull_host_blocks *blocks, const struct lull_host_view *view, int counts,
                       struct lull_host_shown *out, struct lull_error *err);
void lull_host_hide(struct lull_host_shown *shown);

/* --- ask.c ---------------------------------------------------------------------------------------------------------- */

/* The decision where no criterion was asked: go on. */
struct lull_decision lull_host_undecided(void);

/* A block as a criterion gets it, of the view's halves if it has some. */
struct lull_block lull_host_state_of(const struct lull_host_block *block, uint32_t index, int has_half);

/* --- schedule.c ------------------------------------------------------------------------------------------------------ */

/* The sample count of the check after one at spp: `asked` when the criterion named one, else a geometric step. */
uint64_t lull_host_next_check(const struct lull_host_blocks *blocks, uint64_t spp, uint64_t asked);

/* --- forecast.c ------------------------------------------------------------------------------------------------------ */

/* Predictions are taken as they are: from a hundred samples on they were neither low nor high (docs/results/quote.md). The
 * interval widens with the octaves from the samples at hand to the predicted ones, and to an octave either way for a block
 * that is undersampled. It does not stop before `spp`: samples that it has or gets in any case, 0 … spp_max. */
struct lull_host_stop_at lull_host_expect(const struct lull_host_response *response, uint64_t spp, uint64_t spp_max);
/* Of a block of a render that is going on. A stopped block: where it did. */
struct lull_host_stop_at lull_host_expect_block(const struct lull_host_blocks *blocks, const struct lull_host_block *block);
/* More checks of a block that stops at `spp`: as many per octave as the criterion asks for now. */
double lull_host_expect_checks(const struct lull_host_block *block, double spp);

/* Work that is left in one block, whose samples all cost the same. */
struct lull_host_work {
    double spp;      /* more samples per pixel, >= 0 */
    double thread_s; /* for all of them */
    int64_t rows;    /* of pixels: what threads share a block by */
};

/* Wall seconds of `count` blocks sampled side by side, each until it has its samples: a block's rows are all that can be
 * done at once, so the last blocks leave threads idle. Sorts `work`. threads >= 1; as many processors are taken to be
 * free. */
double lull_host_wall_s(struct lull_host_work *work, uint32_t count, int32_t threads);
/* --- stop_map.c ----------------------------------------------------------------------------------------------------- */

/* The picture of lull_host_value_map; the caller frees out->rgb. */
int32_t lull_host_paint(const struct lull_host_blocks *blocks, const double *values, const char *unit,
                        struct pic_canvas *out, struct lull_error *err);

/* --- state.c -------------------------------------------------------------------------------------------------------- */

int32_t lull_host_load_history(struct lull_host_criterion *criterion, const void *data, uint64_t size,
                               struct lull_error *err);

/* --- report.c ------------------------------------------------------------------------------------------------------- */

struct cJSON;
/* Appends to `list` what every report says of a block, and returns that object; noisy_error NULL: not known. *failed: no
 * memory. */
struct cJSON *lull_host_report_block(struct cJSON *list, const struct lull_host_block *b, const double *noisy_error,
                                     int *failed);

#endif
