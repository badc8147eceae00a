/* SPDX-License-Identifier: MIT
 *
 * lull-check: what its parts share.
 *
 * Each check runs in a child process of its own, which loads the library anew: a criterion that crashes, exits, hangs or
 * leaves a mess fails one check and no more. Not thread safe unless said.
 */
#ifndef LULL_CHECK_H
#define LULL_CHECK_H

#include <lull/loader.h>

#include <stdatomic.h>

#include "../src/process_state.h"

/* --- a check and its world ------------------------------------------------------------------------------------------- */

enum { LC_PAIRS_MAX = 64 };
enum { LC_EXIT_OK = 0, LC_EXIT_FAILED = 1, LC_EXIT_USAGE = 2 };

struct lc {
    const char *path;                       /* the library */
    const struct lull_criterion *criterion; /* the one under test */
    struct lull_pair pairs[LC_PAIRS_MAX];   /* of the command line, given to every create */
    uint32_t pair_count;
    struct lull_requirements req; /* of an instance made with them */
    int required_only;            /* frames supply no more planes than it requires */
    uint32_t planes;              /* mask of those that frames supply */
    uint32_t workers;             /* threads for concurrent checks, at least 2 */
    uint64_t seed, misuse;        /* of the random calls outside the rules, and how many */
    struct lc_report *report;
    int concurrent; /* the check itself runs threads: their number says nothing */
};

enum { LC_LINES_MAX = 24, LC_LINE_SIZE = 800 };

/* What a child process says, in memory that its parent sees too. */
struct lc_report {
    int failures, skipped;
    int refused;             /* what the command line asks for cannot be done */
    int completed;           /* the function returned */
    char kind[LC_LINES_MAX]; /* of each line */
    unsigned line_count;     /* kept, first come first served */
    unsigned lines_left_out;
    char lines[LC_LINES_MAX][LC_LINE_SIZE];
    char doing[LC_LINE_SIZE]; /* what lc_doing said last */
};

/* One line to the report; a check with a failure is "not ok". Thread safe. */
__attribute__((format(printf, 3, 4))) void lc_say(struct lc *c, char kind, const char *format, ...);
#define lc_fail(c, ...) lc_say((c), 'F', __VA_ARGS__)
#define lc_note(c, ...) lc_say((c), 'N', __VA_ARGS__)
#define lc_skip(c, ...) lc_say((c), 'S', __VA_ARGS__)
#define lc_refuse(c, ...) lc_say((c), 'R', __VA_ARGS__) /* wrong usage */

/* Memory of the check's own, as malloc returned it. Where there is none, the check has failed and its process ends. */
void *lc_need(struct lc *c, void *memory);

/* What comes now, for the report if the process does not survive it. Not thread safe. */
__attribute__((format(printf, 2, 3))) void lc_doing(struct lc *c, const char *format, ...);

/* Forks; the child calls fn(c, arg), the parent waits, at most limit_s, and fills *report. What the child prints, or a
 * signal that ends it, is a failure; what lc_doing said last is then noted. Returns 0, or -1 if no process could be made.
 * Not thread safe. */
int lc_child_run(struct lc *c, void (*fn)(struct lc *c, const void *arg), const void *arg, unsigned limit_s,
                 struct lc_report *report);

#define LC_EXPECT(c, condition, ...) ((condition) ? 1 : (lc_fail((c), __VA_ARGS__), 0))

/* Every check in the order of the report: lc_check_FUNCTION, its name, what it holds a criterion to. The first
 * LC_WITHOUT_INSTANCE need none; those IN a session are given an open one, and may close it. */
#define LC_CHECKS(X, IN) \
    X(symbols, "symbols", "exports the entry and nothing else") \
    X(load, "load", "loading leaves floating point, threads and signals alone") \
    X(entry, "entry", "the entry ends its list with NULL, also far out") \
    X(table, "table", "the static table is complete") \
    X(unknown_key, "unknown-key", "an unknown key is refused and named") \
    X(params, "parameters", "defaults are accepted, bad values refused and named") \
    X(null, "null", "NULL host, NULL error, a host of NULLs") \
    X(requirements, "requirements", "requirements are complete and make sense") \
    X(older, "older-host", "reads and writes nothing past structs of version 1.0") \
    X(too_short, "short-structs", "structs shorter than 1.0 are refused") \
    X(newer, "newer-host", "longer structs and wider strides change nothing") \
    X(strides, "strides", "negative, interleaved and planar strides give the same answers") \
    X(types, "types", "f16, f64, u32 and scaled values give the same answers") \
    X(normalisers, "normalisers", "sums and weighted sums give the same answers") \
    IN(window, "window", "a view that does not begin at the origin") \
    X(missing, "missing-planes", "required planes are missed, others are not") \
    X(broken_planes, "broken-planes", "planes of an unknown form are refused") \
    X(values, "bad-values", "NaN, infinite, negative and huge pixels") \
    X(flat, "flat", "black, constant and half black blocks") \
    X(firefly, "firefly", "a block is not stopped while a pixel hangs on one sample") \
    X(no_samples, "no-samples", "blocks without samples continue") \
    IN(order, "order", "calls out of order are refused and do no harm") \
    IN(zero_blocks, "zero-blocks", "no blocks to judge") \
    X(shapes, "shapes", "1x1 frames, 1x1 blocks, blocks at the edge") \
    X(block_size, "block-size", "blocks of another size") \
    IN(invalid, "invalid", "senseless frames and blocks are refused and do no harm") \
    IN(restart, "restart", "RESTART forgets") \
    IN(final, "final", "blocks that get no more samples") \
    X(cancel, "cancel", "cancelled calls do no harm") \
    X(repeat, "repeat", "the same question gets the same answer and leaves no trace") \
    X(batch, "batch", "an answer does not depend on the blocks beside it") \
    X(two, "two-instances", "two instances do not know of each other") \
    X(workers, "workers", "any number of workers, tasks in any order") \
    X(concurrent, "concurrent", "concurrent evaluate calls on one instance") \
    X(instances, "instances", "concurrent instances") \
    X(fp, "fp", "floating-point control and threads are left alone, FTZ and DAZ tolerated") \
    X(state, "state", "lull.state/1: saved, loaded, cut short, damaged") \
    X(misuse, "misuse", "random calls outside the rules are refused and leave no trace") \
    X(leaks, "leaks", "create and destroy, frames, failures: what is left does not grow with their number") \
    X(out_of_memory, "out-of-memory", "create and begin_frame survive every failing allocation") \
    IN(evaluate_allocates, "evaluate-allocates", "evaluate allocates nothing") \
    X(time, "time", "time per block")
enum { LC_WITHOUT_INSTANCE = 4 };

struct lc_session;
#define LC_DECLARE(function, name, title) void lc_check_##function(struct lc *c);
#define LC_DECLARE_IN(function, name, title) void lc_check_##function(struct lc *c, struct lc_session *s);
LC_CHECKS(LC_DECLARE, LC_DECLARE_IN)

/* --- host -------------------------------------------------------------------------------------------------------------- */

enum { LC_WORKERS_MAX = 64 };

/* A host with real threads that can misbehave on request. */
struct lc_host {
    struct lull_host host; /* first: context points back */
    uint32_t threads;      /* per parallel_for; 1 = in the caller's thread */
    int reverse;           /* last task first */
    int cancel;            /* cancelled() says so, and parallel_for leaves out all tasks but the first */
    struct lc *check;
    atomic_uchar taken[LC_WORKERS_MAX]; /* which worker numbers are */
};

/* fn for each of `count` arguments of `size` bytes, at the same time: the first in the caller's thread, each other in one of
 * its own if there is one. LC_WORKERS_MAX at most. */
void lc_at_once(void *(*fn)(void *arg), void *args, size_t size, uint32_t count);

/* max_workers is 2 * threads, so that two evaluate calls may each run `threads` tasks. */
void lc_host_init(struct lc_host *h, struct lc *c, uint32_t threads);

/* --- image ------------------------------------------------------------------------------------------------------------- */

/* Grey in stripes: of columns 0 to 11, of the next twelve, and so on; noise relative to it. */
struct lc_paint {
    double even, odd, sigma;
};

enum { LC_BLOCKS_MAX = 20, LC_STEPS = 7 }; /* blocks of a film, steps of a session */

/* How an image is stored. All zero: tight interleaved float estimates, top-down. */
struct lc_layout {
    int32_t type;
    int32_t normaliser; /* ONE, SPP (HALF then uses HALF_SPP) or WEIGHT */
    int padded;         /* a fourth, unused channel of NaN */
    int planar;         /* channel planes */
    int bottom_up;
    int right_left;
    int guard;             /* each plane between two pages that cannot be read */
    double scale;          /* 0 = 1 */
    uint32_t extra_planes; /* unknown planes after the known ones */
    uint32_t plane_slack;  /* bytes between plane descriptors */
};

enum lc_ask { LC_ASK_ALL, LC_ASK_TWICE, LC_ASK_REVERSED, LC_ASK_SINGLY, LC_ASK_CONCURRENTLY };

/* How a session asks, and about which film. All zero, or NULL in the place of one: no host, all due blocks in one call,
 * tight structs, the frame that suits the criterion. */
struct lc_manner {
    const struct lull_host *host;
    struct lc_layout layout;
    enum lc_ask ask;
    uint32_t slack;    /* bytes between the elements of arrays and after structs, filled with garbage */
    int required_only; /* supply only the required planes */
    int no_all;        /* view.all is NULL */
    uint32_t frame_flags;

    int nominal; /* blocks of the size that the criterion was made for */
    struct {
        int32_t width, height, block_width, block_height;
    } size;                       /* all 0: what suits the criterion */
    const struct lc_paint *paint; /* borrows; NULL: a gradient with noise */
    uint32_t seed;
};

/* A picture of blocks with made-up noise that falls with the number of samples. All estimates are multiples of 1/256
 * below 8 in magnitude, so that every storage type holds them exactly and answers can be compared across types. */
struct lc_film {
    int32_t width, height;
    uint32_t seed;
    uint32_t block_count;
    struct lull_rect rects[LC_BLOCKS_MAX];
    struct lull_block blocks[LC_BLOCKS_MAX]; /* their state */
    double *sum[LULL_PLANE_COUNT];           /* owns: sums over samples, [height][width][channels]; SPP and WEIGHT unused */
    const struct lc_paint *paint;            /* borrows; NULL: a gradient with noise */
};

extern const uint32_t lc_plane_channels[LULL_PLANE_COUNT];
extern const char *const lc_plane_names[LULL_PLANE_COUNT];

/* Of the manner's size: blocks smaller at the right and bottom edge, LC_BLOCKS_MAX at most. The frame that suits the
 * criterion has two by one blocks and the rest at the edges, one of them 1x1. They are of the size it was made for if that
 * is the only one it takes or if nominal is set, else small, which saves time. */
enum { LC_FILM_BLOCKS = 6 };
void lc_film_init(struct lc_film *f, struct lc *c, const struct lc_manner *manner);
void lc_film_release(struct lc_film *f);
/* Adds samples until the block has spp; nothing if it has. */
void lc_film_advance(struct lc_film *f, uint32_t id, uint64_t spp);
void lc_film_frame(const struct lc_film *f, struct lull_frame *frame, uint32_t planes);

struct lc_image {
    struct lull_view view;
    char *descriptors;                /* owns */
    void *memory[LULL_PLANE_COUNT];   /* owns */
    size_t guarded[LULL_PLANE_COUNT]; /* bytes, if it lies between pages that cannot be read; else 0 */
};

/* Stores the film's planes of the mask. Overwrites *image, which needs lc_image_release afterwards. */
void lc_image_build(struct lc_image *image, struct lc *c, const struct lc_film *f, const struct lc_layout *layout,
                    uint32_t planes);
void lc_image_release(struct lc_image *image);
struct lull_plane *lc_image_plane(struct lc_image *image, unsigned plane);
/* Overwrites what is stored at a pixel of a float image with default layout, if the image has the plane: in one plane, or
 * in all that hold floats. */
void lc_image_poke_plane(struct lc_image *image, unsigned plane, int32_t x, int32_t y, float value);
void lc_image_poke(struct lc_image *image, int32_t x, int32_t y, float value);

/* --- guarded memory ---------------------------------------------------------------------------------------------------- */

/* Memory for what calls are given, right before a page that cannot be touched: a copy of so many bytes (NULL: garbage),
 * eight at least. There are ten pieces in turn; no call of the random ones, and no life with short structs, is given as many
 * things. */
void *lc_place(struct lc *c, const void *from, size_t size);
/* The same of a struct, which says that it has so many bytes. */
void *lc_place_struct(struct lc *c, const void *from, size_t size);
/* Elements of `size` bytes, `stride` apart; with a stride that is too short, room without elements. */
void *lc_place_array(struct lc *c, const void *from, size_t size, uint32_t count, uint32_t stride);

/* --- sessions -------------------------------------------------------------------------------------------------------- */

struct lc_answer {
    uint32_t id;
    uint64_t spp;
    struct lull_decision decision;
};

struct lc_log {
    struct lc_answer items[LC_STEPS * LC_BLOCKS_MAX];
    size_t count;
};

/* One render from begin_frame to end_frame. */
struct lc_session {
    struct lc *check;
    struct lc_manner manner;
    struct lc_film film;
    struct lull_instance *instance; /* owns */
    uint32_t planes;                /* mask supplied */
    uint64_t spp;                   /* of the even blocks at the next step; odd ones have twice as many */
    uint32_t step;
    struct lc_log log;
    double evaluate_s;  /* in evaluate so far */
    uint64_t evaluated; /* blocks */
    int open;
};

/* Makes an instance and begins the frame. Not 0 if that failed (which is reported). */
int lc_session_open(struct lc_session *s, struct lc *c, const struct lc_manner *manner);
/* Begins the frame again (RESTART) with no samples and an empty log. */
int lc_session_restart(struct lc_session *s);
/* Adds samples to the blocks that have not stopped. Returns how many, their ids in ids[film.block_count]. */
uint32_t lc_session_advance(struct lc_session *s, uint32_t *ids);
/* Adds samples, asks about the blocks that have not stopped, logs the answers. Not 0 if that failed (which is reported). */
int lc_session_step(struct lc_session *s);
int lc_session_steps(struct lc_session *s, int steps);
void lc_session_image(struct lc_session *s, struct lc_image *image);
/* Only the asking, by an image that is released then (NULL: that of the film): status of the call, answers into
 * decisions[film.block_count] by id; reports nothing but broken rules. */
int32_t lc_session_ask(struct lc_session *s, struct lc_image *image, const uint32_t *ids, uint32_t count,
                       struct lull_decision *decisions, struct lull_error *err);
/* The same about all blocks as they are, LC_FILM_BLOCKS at most. Returns whether there were answers, each held against the
 * header's rules; else "evaluate WHAT: …" is reported. */
int lc_session_judge(struct lc_session *s, struct lc_image *image, struct lull_decision decisions[LC_FILM_BLOCKS],
                     const char *what);
void lc_session_close(struct lc_session *s);

/* The whole session in one manner: its log. Not 0 if it failed (which is reported). */
int lc_run(struct lc *c, const struct lc_manner *manner, struct lc_log *log);
/* Such a session, whose log is held against the expected one. Negative if it failed, 1 if it
 * differs; both are reported. */
int lc_run_as(struct lc *c, const struct lc_manner *manner, const struct lc_log *expected, int exact, const char *what);
/* Two sessions, the second of which must be like the first, bit for bit. */
void lc_run_both(struct lc *c, const struct lc_manner *a, const struct lc_manner *b, const char *what);
/* Reports the first difference as "what: …". exact: bit for bit; else the actions and, within 0.1 %, the numbers. */
int lc_log_compare(struct lc *c, const struct lc_log *expected, const struct lc_log *got, int exact, const char *what);

/* An instance with the command line's parameters; NULL after a failure, which is reported. */
struct lull_instance *lc_create(struct lc *c, const struct lull_host *host);
int32_t lc_begin(struct lc *c, struct lull_instance *instance, const struct lull_frame *frame, struct lull_error *err);
void lc_decision_preset(struct lull_decision *d);
/* Reports an answer that breaks a rule of the header. */
void lc_decision_check(struct lc *c, const struct lull_block *block, const struct lull_decision *d);
int lc_deterministic(const struct lc *c);

/* Where a state is written to and read from. */
struct lc_buffer {
    char *data; /* owns what lc_buffer_write made */
    uint64_t size, at;
    uint64_t limit; /* bytes until writing fails */
};

/* For lull_writer and lull_reader; their context is a struct lc_buffer. */
int32_t lc_buffer_write(const struct lull_writer *writer, const void *data, uint64_t size);
int32_t lc_buffer_read(const struct lull_reader *reader, void *data, uint64_t size);
/* Appends the state of the session's instance: the status of save. */
int32_t lc_state_save(const struct lull_state *state, const struct lc_session *s, struct lc_buffer *b,
                      struct lull_error *err);

/* --- the rest ---------------------------------------------------------------------------------------------------------- */

/* The entry of a library that the loader has accepted before; NULL if that fails. */
lull_entry_fn lc_entry(const char *path);
/* A Python file has no entry: the loader makes its table. */
int lc_is_script(const char *path);

/* The i-th parameter of the criterion. */
const struct lull_param *lc_param(const struct lc *c, uint32_t i);

/* Calls of malloc and friends by this process; -1 in a build that cannot count them (sanitizers). */
long lc_alloc_count(void);
/* Allocations that are not freed, and their bytes; 0 in such a build, whose LeakSanitizer looks for what is lost. */
void lc_alloc_live(long *count, long *bytes);
/* The k-th allocation from now on (0 = the next) fails, and so do all that follow; -1 = none. No effect where not counted.
 */
void lc_alloc_fail_after(long k);

#endif
