/* SPDX-License-Identifier: MIT
 *
 * lull/criterion.h - when may a renderer stop sampling a block of its image?
 *
 * A renderer (the host) accumulates samples. A criterion, loaded from a shared object, answers for each block of pixels:
 * continue or stop, and at how many samples to ask again. This header is the whole contract between the two, version 1.0.
 * It needs nothing but stddef.h and stdint.h and is valid C99 and C++11. lull-check(1) tests a criterion against it.
 *
 * Life of a criterion
 *
 *     info = lull_criterion_entry_v1(0)             static table, NULL past the last criterion of the library
 *     info->create(host, pairs…) → instance         the only place where parameters are read
 *     info->requirements(instance) → planes …       the host then accumulates what is used, and nothing else
 *     info->begin_frame(instance, frame)            size, blocks, limits; the criterion allocates what it needs
 *       info->evaluate(instance, view, blocks → decisions)      as often as the host likes, allocates nothing
 *     info->end_frame(instance)
 *     info->destroy(instance)
 *
 * Rules that hold for every function and struct below
 *
 * Sizes.    A struct that can grow begins with struct_size, the sizeof that its allocator was compiled with; later minor
 *           versions only append fields, so a reader tests LULL_HAS() before it touches a field newer than 1.0. The fields
 *           of 1.0 are always there: a smaller struct_size is refused with LULL_E_VERSION before anything else is read.
 *           Elements of arrays carry no size; the array comes with a stride in bytes, to be used instead of sizeof.
 *           Where pointers have 8 bytes there is no padding anywhere; layout-1.txt lists every offset.
 * Memory.   Nobody frees what the other allocated. Text in static tables lives for ever. A pointer in an argument is
 *           borrowed until the call returns, unless its comment says otherwise; who needs it longer copies it.
 * Errors.   Functions return LULL_OK or a negative LULL_E_ code and, if err is not NULL, fill *err. A call that fails leaves
 *           the instance as it was and its results are ignored; the blocks of a failed evaluate continue, so that an error
 *           costs time and never quality. err is untouched on success. A criterion never exits, aborts, prints, raises
 *           signals or lets an exception out.
 * Threads.  Every function says which calls may overlap:
 *             [ctl]  calls on one instance never overlap each other or an [eval] call on that instance;
 *             [eval] like [ctl], but may overlap other [eval] calls on the instance if the criterion declares
 *                    LULL_THREADS_FULL (never for the same block);
 *             [any]  at any time from any thread.
 *           A criterion starts no threads; it may use the host's parallel_for. It holds no lock while it calls the host.
 * Numbers.  The floating-point environment is left as found. A criterion must work under any rounding of subnormals
 *           (FTZ, DAZ). NaN means "not known" wherever a double may say so.
 * Text.     UTF-8, NUL-terminated. Numbers in text have the form of the C locale whatever locale the process has set.
 * Pixels.   x grows to the right and y downwards; (0, 0) is the top left pixel of the frame. Rectangles are half open:
 *           x0 <= x < x1, y0 <= y < y1.
 */
#ifndef LULL_CRITERION_H
#define LULL_CRITERION_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LULL_API_MAJOR 1 /* part of the entry's name: another major is another symbol */
#define LULL_API_MINOR 0

#define LULL_ENTRY_NAME "lull_criterion_entry_v1"

#if defined(_WIN32)
#define LULL_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define LULL_EXPORT __attribute__((visibility("default")))
#else
#define LULL_EXPORT
#endif

/* Does the struct at p, of type T and of the size its allocator gave it, hold this field? */
#define LULL_HAS(T, p, field) (offsetof(T, field) + sizeof((p)->field) <= (p)->struct_size)

/* --- status -------------------------------------------------------------------------------------------------------- */

#define LULL_OK 0
#define LULL_E_INVALID (-1)     /* an argument makes no sense: a NULL that is not allowed, an empty frame, a bad block */
#define LULL_E_KEY (-2)         /* create: no parameter has this name */
#define LULL_E_VALUE (-3)       /* create: not a value of this parameter, out of its range, or none where one is needed */
#define LULL_E_MEMORY (-4)      /* out of memory */
#define LULL_E_PLANE (-5)       /* a required plane is missing or has a form that is not described here */
#define LULL_E_STATE (-6)       /* the call does not fit the life cycle, such as evaluate before begin_frame */
#define LULL_E_IO (-7)          /* a file, a stream or saved state could not be read or written */
#define LULL_E_VERSION (-8)     /* a struct is smaller than in version 1.0 */
#define LULL_E_UNSUPPORTED (-9) /* valid, but this criterion cannot do it, such as blocks of this size */
#define LULL_E_CANCELLED (-10)  /* the host's cancelled() said so */
#define LULL_E_INTERNAL (-11)   /* a bug or a failure of something underneath */

/* Owned by the caller, who sets struct_size; the callee fills code and message (cut if need be, always terminated). */
struct lull_error {
    uint32_t struct_size;
    int32_t code;
    char message[504]; /* one line for people; names the key, the file, the plane */
};

/* --- the host ------------------------------------------------------------------------------------------------------ */

#define LULL_LOG_ERROR 0
#define LULL_LOG_WARNING 1
#define LULL_LOG_INFO 2
#define LULL_LOG_DEBUG 3

typedef void (*lull_task_fn)(void *arg, uint64_t task, uint32_t worker);

/* What the host offers. Given to create and borrowed until destroy returns. Every function pointer may be NULL, and the
 * host pointer itself may be NULL: then there is no log, one worker, no cancelling and no extension. */
struct lull_host {
    uint32_t struct_size;
    uint32_t api_minor;   /* LULL_API_MINOR the host was compiled with */
    void *context;        /* the host's own; a criterion does not touch it */
    const char *name;     /* program and version, for messages; may be NULL */
    uint32_t max_workers; /* workers of parallel_for, at least 1 (0 reads as 1); constant while the instance lives */
    uint32_t flags;       /* 0 */

    /* [any] Hands one line of text, without newline, to the host, which copies it. */
    void (*log)(const struct lull_host *host, int32_t level, const char *text);

    /* [ctl][eval] Calls fn(arg, task, worker) for each task in [0, count), in any order and on any threads, and returns
     * when all are done. worker < max_workers, and no two tasks that run at the same time for one instance have the same
     * worker, so that scratch memory can be allocated once per worker. Only from begin_frame and evaluate, on the thread
     * that called them, not from within fn. Returns LULL_OK, or LULL_E_CANCELLED if tasks were left out.
     * A host without parallel_for never overlaps [eval] calls on one instance; run the tasks in a loop as worker 0. */
    int32_t (*parallel_for)(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg);

    /* [any] Not 0 once the host wants a running call back soon; that call may then return LULL_E_CANCELLED. */
    int32_t (*cancelled)(const struct lull_host *host);

    /* [any] The host's side of an extension: a static struct, or NULL if the host does not know the id. */
    const void *(*get_extension)(const struct lull_host *host, const char *id);
};

/* --- parameters ---------------------------------------------------------------------------------------------------- */

#define LULL_PARAM_INT 0    /* decimal integer in [min, max] */
#define LULL_PARAM_FLOAT 1  /* decimal number in [min, max] */
#define LULL_PARAM_BOOL 2   /* 0 or 1 */
#define LULL_PARAM_CHOICE 3 /* one of choices */
#define LULL_PARAM_FILE 4   /* path of a file */
#define LULL_PARAM_TEXT 5   /* anything */

/* Element of a static table. */
struct lull_param {
    const char *name;          /* [a-z0-9-]+, unique in its table */
    const char *help;          /* one sentence, with the unit */
    const char *default_value; /* text that create would accept, or NULL if there is none */
    const char *choices;       /* CHOICE: the values, joined by '|'; else NULL */
    double min, max;           /* INT, FLOAT: inclusive range (min <= default <= max); else 0 */
    int32_t type;              /* LULL_PARAM_ */
    uint32_t flags;            /* 0 */
};

struct lull_pair {
    const char *key;
    const char *value;
};

/* --- what a criterion asks for --------------------------------------------------------------------------------------- */

/* Planes, by index into lull_view.planes. All hold estimates that belong to the samples taken so far; COLOR, MOMENT2 and
 * HALF hold the same samples, after the host's clamp and before any denoising. */
#define LULL_PLANE_COLOR 0   /* 3 channels: mean radiance, linear RGB of lull_frame.rgb_to_xyz */
#define LULL_PLANE_WEIGHT 1  /* 1 channel: sum of the filter weights; the N of LULL_NORM_WEIGHT */
#define LULL_PLANE_SPP 2     /* 1 channel: samples of this pixel, if they differ within a block; absent = the block's spp */
#define LULL_PLANE_MOMENT2 3 /* 1 channel: mean of the squared luminance Y of the samples, Y by row 2 of rgb_to_xyz */
#define LULL_PLANE_HALF 4    /* 3 channels: like COLOR, from a fixed subset of half_spp of the samples, chosen beforehand */
#define LULL_PLANE_ALBEDO 5  /* 3 channels: mean reflectance at the first non-specular hit; 0 where the path leaves */
#define LULL_PLANE_NORMAL 6  /* 3 channels: mean unit normal there, world space; 0 where the path leaves */
#define LULL_PLANE_DEPTH 7   /* 1 channel: mean distance from the camera to the first hit, scene units; 0 = no hit */
#define LULL_PLANE_COUNT 8

#define LULL_PLANE_BIT(plane) (UINT32_C(1) << (plane)) /* for the plane masks */

#define LULL_REQ_FLEXIBLE UINT32_C(1) /* also judges blocks of other sizes than block_width x block_height */

/* Filled by requirements; the caller sets struct_size. */
struct lull_requirements {
    uint32_t struct_size;
    uint32_t flags;           /* LULL_REQ_ */
    uint32_t planes_required; /* mask of LULL_PLANE_BIT: begin_frame fails without these */
    uint32_t planes_used;     /* mask, contains planes_required: the rest is read when it is there */
    uint32_t block_width;     /* block size that it was made for, 0 = any; blocks at the edge of a frame may always */
    uint32_t block_height;    /*   be smaller, down to 1x1 */
    uint32_t halo;            /* reads up to so many pixels beyond a block's edges, as far as the view reaches */
    uint32_t checks_hint;     /* about how many checks per block it wants, for the host's cost planning; 0 = unknown */
    uint64_t first_spp;       /* asking before so many samples is useless (TOO_EARLY); at least 1 */
    uint64_t bytes_per_block; /* memory that a frame costs, per block; an upper estimate */
};

/* --- a frame ------------------------------------------------------------------------------------------------------- */

struct lull_rect {
    int32_t x0, y0, x1, y1;
};

#define LULL_FRAME_RESTART UINT32_C(1)       /* a frame is open: drop its history, its samples were thrown away */
#define LULL_FRAME_DETERMINISTIC UINT32_C(2) /* decisions must depend on samples only, not on time */
#define LULL_FRAME_INDEPENDENT UINT32_C(4)   /* the samples of a pixel are independent (not stratified, no sequence) */
#define LULL_FRAME_SHARED UINT32_C(8) /* neighbouring pixels share samples (splatted filter): their noise correlates */

/* How linear radiance becomes what is seen: out = transfer(exposure * value), clamped to [0, 1]. */
#define LULL_TRANSFER_UNKNOWN 0 /* treat as sRGB */
#define LULL_TRANSFER_LINEAR 1
#define LULL_TRANSFER_SRGB 2  /* IEC 61966-2-1 */
#define LULL_TRANSFER_GAMMA 3 /* out = in^(1 / gamma) */

/* What stays constant while a frame is rendered. */
struct lull_frame {
    uint32_t struct_size;
    uint32_t flags; /* LULL_FRAME_ */
    uint32_t width; /* of the whole picture, pixels, also if only a part of it (a crop) is rendered */
    uint32_t height;

    /* The blocks: disjoint, not empty, inside the picture; any tiling, none need cover it. The index is the block's id. */
    const struct lull_rect *blocks;
    uint32_t block_count;
    uint32_t block_stride; /* bytes from one rectangle to the next */

    uint32_t planes;      /* mask of the planes that every view of this frame will supply */
    int32_t transfer;     /* LULL_TRANSFER_ */
    double gamma;         /* for LULL_TRANSFER_GAMMA */
    double exposure;      /* linear factor, > 0 */
    double sample_clamp;  /* the host clamps samples to this value; 0 = it does not (then rare bright samples may come) */
    double time_budget_s; /* wall seconds for the whole frame; 0 = no limit */
    uint64_t spp_min;     /* the host will not stop a block before, whatever is decided */
    uint64_t spp_max;     /* the host stops every block here; 0 = no limit */
    uint64_t seed;        /* of the render; a criterion that needs random numbers derives them from it */
    double rgb_to_xyz[9]; /* row major: XYZ = M * RGB; row 2 gives luminance */
};

/* --- pixels -------------------------------------------------------------------------------------------------------- */

#define LULL_TYPE_F32 0
#define LULL_TYPE_F16 1 /* IEEE 754 binary16 */
#define LULL_TYPE_F64 2
#define LULL_TYPE_U32 3

/* estimate = stored * scale / N. Blocks stop at different spp, hence N is the block's (or the pixel's) and never global.
 * WEIGHT is supplied whenever a plane uses it, also if the criterion did not ask for it; it is of LULL_NORM_ONE itself and
 * may share its memory with SPP. */
#define LULL_NORM_ONE 0      /* N = 1: the estimate itself is stored */
#define LULL_NORM_SPP 1      /* N = spp of the block that the pixel belongs to: a sum is stored */
#define LULL_NORM_HALF_SPP 2 /* N = half_spp of that block */
#define LULL_NORM_WEIGHT 3   /* N = WEIGHT at that pixel */

/* Where one plane lies. Element (x, y, channel) is at
 *     (const char *)data + (x - view.x0) * stride_x + (y - view.y0) * stride_y + channel * stride_c
 * and is aligned to its type. Strides may be negative (bottom-up images) or wider than the pixel (RGBA, interleaved).
 * Stored values can be anything, NaN and infinities included; where N = 0 there is no estimate. */
struct lull_plane {
    const void *data;                     /* NULL: this plane is absent */
    int64_t stride_x, stride_y, stride_c; /* bytes */
    double scale;                         /* finite, not 0; usually 1 */
    int32_t type;                         /* LULL_TYPE_ */
    int32_t normaliser;                   /* LULL_NORM_ */
    uint32_t channels;                    /* at least as many as listed at LULL_PLANE_; the rest is not read */
    uint32_t flags;                       /* 0 */
};

#define LULL_BLOCK_STOPPED UINT32_C(1) /* was stopped; only asked about if the criterion declares LULL_CAP_REOPENS */
#define LULL_BLOCK_FINAL UINT32_C(2)   /* gets no more samples (spp_max, time budget): the answer is for the report only */

/* State of one block. */
struct lull_block {
    uint32_t id;            /* index into lull_frame.blocks */
    uint32_t flags;         /* LULL_BLOCK_ */
    int32_t x0, y0, x1, y1; /* its rectangle of begin_frame again, so that simple criteria need not keep it */
    uint64_t spp;           /* samples per pixel in COLOR and MOMENT2; 0 is possible */
    uint64_t half_spp;      /* samples per pixel in HALF; 0 if there is no such plane */
    double thread_s;        /* thread seconds spent on the block so far; NaN = not known */
};

/* The image at this moment. */
struct lull_view {
    uint32_t struct_size;
    uint32_t flags;                  /* 0 */
    int32_t x0, y0, x1, y1;          /* the pixels that the planes hold: contains every block of the frame; a pixel inside
                                      * it may be read even if it belongs to no block or to one that was not asked about */
    const struct lull_plane *planes; /* index LULL_PLANE_ */
    uint32_t plane_count;            /* planes at and after this index are absent */
    uint32_t plane_stride;           /* bytes */
    const struct lull_block *all;    /* state of every block by id, for reading across edges (N of the neighbours);
                                      * NULL: not kept, take a block's edge for the edge of the image */
    uint32_t all_count;
    uint32_t all_stride; /* bytes */
    double elapsed_s;    /* wall seconds since begin_frame; NaN = not known */
};

/* --- decisions ----------------------------------------------------------------------------------------------------- */

#define LULL_CONTINUE 0
#define LULL_STOP 1

#define LULL_DECISION_TOO_EARLY UINT32_C(1) /* too few samples or checks for a judgement */
#define LULL_DECISION_BAD_INPUT UINT32_C(2) /* NaN, infinite or otherwise unusable pixels were seen and left out */

/* One answer. The host presets CONTINUE, 0, 0 and NaN; a criterion that succeeds writes every field it knows. */
struct lull_decision {
    int32_t action;       /* LULL_CONTINUE or LULL_STOP */
    uint32_t flags;       /* LULL_DECISION_ */
    uint64_t next_spp;    /* CONTINUE: ask again at so many samples, > spp; 0 = the host chooses (it may ask at any time) */
    double p_noisy;       /* probability in [0, 1] that a viewer still sees noise in the block; NaN = not provided */
    double predicted_spp; /* samples at which it expects to stop this block, for the host's ETA; NaN = not provided */
    double error;         /* the criterion's own measure, >= 0, falls as samples come in; NaN = not provided */
};

/* --- the criterion ------------------------------------------------------------------------------------------------- */

#define LULL_THREADS_NONE 0     /* calls into this library never overlap, whatever the instance */
#define LULL_THREADS_INSTANCE 1 /* different instances may be used at the same time */
#define LULL_THREADS_FULL 2     /* and [eval] calls on one instance may overlap */

#define LULL_CAP_DETERMINISTIC UINT32_C(1)   /* same calls, same answers, bit for bit, on any number of workers */
#define LULL_CAP_BATCH_INVARIANT UINT32_C(2) /* an answer does not depend on which blocks share the call or their order */
#define LULL_CAP_REOPENS UINT32_C(4)         /* wants to be asked about stopped blocks too; CONTINUE re-opens one */

struct lull_instance; /* the criterion's own */

/* Static table, one per criterion of the library; never NULL: every pointer except params (if param_count is 0). */
struct lull_criterion {
    uint32_t struct_size;
    uint32_t api_minor;      /* LULL_API_MINOR the criterion was compiled with */
    const char *id;          /* [a-z0-9.-]+, what users type; unique in the library; stays for ever */
    const char *name;        /* a few words */
    const char *version;     /* of the criterion; changes whenever its answers do */
    const char *description; /* what it measures (what error means) and whose method it is; may have several lines */
    const struct lull_param *params;
    uint32_t param_count;
    uint32_t param_stride; /* bytes */
    int32_t thread_level;  /* LULL_THREADS_ */
    uint32_t capabilities; /* LULL_CAP_ */

    /* [any], but see LULL_THREADS_NONE. Makes an instance with the defaults, overridden by pairs (a later pair wins). On
     * failure *instance is untouched and the message names the key. The instance is owned by the host until destroy. */
    int32_t (*create)(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err);

    /* [ctl] May depend on the parameters, not on the frame. */
    int32_t (*requirements)(const struct lull_instance *instance, struct lull_requirements *req, struct lull_error *err);

    /* [ctl] Begins a frame; copies what it needs of it. LULL_E_STATE if one is open and LULL_FRAME_RESTART is not set.
     * When it fails, the instance is as before, an open frame included. */
    int32_t (*begin_frame)(struct lull_instance *instance, const struct lull_frame *frame, struct lull_error *err);

    /* [eval] Judges count blocks (0 is allowed), each at most once per call. History is keyed by spp: a block asked twice
     * with the same spp gets the same answer, and the second time leaves no trace. A block's spp never falls within a
     * frame. An answer is about pixels inside the block (and the halo); it never depends on other blocks' decisions. */
    int32_t (*evaluate)(struct lull_instance *instance, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err);

    /* [ctl] Forgets the frame; nothing happens if none is open. */
    void (*end_frame)(struct lull_instance *instance);

    /* [ctl] Frees the instance, an open frame included. NULL is allowed. */
    void (*destroy)(struct lull_instance *instance);

    /* [any] The criterion's side of an extension: a static struct, or NULL if it does not know the id. */
    const void *(*get_extension)(const char *id);
};

/* The one symbol that a library exports. [any] Returns the criterion at this index, NULL past the last; the same pointer
 * each time, no side effects, nothing to be done before. */
LULL_EXPORT const struct lull_criterion *lull_criterion_entry_v1(uint32_t index);

typedef const struct lull_criterion *(*lull_entry_fn)(uint32_t index);

/* --- extensions ---------------------------------------------------------------------------------------------------- */

/* An id is a name, a slash and a revision; it never changes its meaning, also not when a draft becomes stable. */

/* lull.state/1, of the criterion: save and load the history of the open frame, for checkpoint and resume. A criterion
 * without history needs it not; one that keeps none in this frame writes nothing. After load the answers are those of the
 * saved instance, bit for bit if DETERMINISTIC. */
#define LULL_EXT_STATE "lull.state/1"

/* Made by the host for one save or load. */
struct lull_writer {
    uint32_t struct_size;
    uint32_t flags;                                                                      /* 0 */
    void *context;                                                                       /* the host's own */
    int32_t (*write)(const struct lull_writer *writer, const void *data, uint64_t size); /* all, or a LULL_E_ code */
};

struct lull_reader {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    void *context;
    int32_t (*read)(const struct lull_reader *reader, void *data, uint64_t size); /* exactly size bytes, or a LULL_E_ code */
};

struct lull_state {
    uint32_t struct_size;
    uint32_t flags; /* 0 */

    /* [ctl] Between begin_frame and end_frame. */
    int32_t (*save)(const struct lull_instance *instance, const struct lull_writer *writer, struct lull_error *err);

    /* [ctl] After begin_frame with the frame of the save (RESTART aside), on an instance with the same parameters.
     * The bytes may come from anywhere: they are checked, and a refused state (LULL_E_IO) leaves the instance as it was. */
    int32_t (*load)(struct lull_instance *instance, const struct lull_reader *reader, struct lull_error *err);
};

#ifdef __cplusplus
}
#endif

#endif
