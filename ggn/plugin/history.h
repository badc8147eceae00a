/*
 * What a criterion remembers of a frame: for each block what it keeps of the last S images it judged, keyed by spp.
 *
 * One allocation per frame. A block owns S + 1 slots: a new image goes into the spare one and becomes part of the history
 * only when the whole evaluate call has succeeded, so that a failed or cancelled call leaves no trace.
 * Tasks on different blocks may run at the same time; nothing else is thread-safe.
 */
#ifndef GGN_PLUGIN_HISTORY_H
#define GGN_PLUGIN_HISTORY_H

#include <stddef.h>
#include <stdint.h>

#include <lull/criterion.h>

#include "model/stopper.h"

enum { GP_SLOTS_MAX = GGN_WINDOW_MAX + 1 };

/* What a slot holds of an image: bytes that are saved with the state, after some that can be made again from those. */
struct gp_slot {
    size_t made, kept;
};

/* Fixed-size part of a block's history. Copied as a whole between pending and current; without padding. */
struct gp_head {
    struct ggn_stopper stopper;   /* its window's images are order[0 .. used − 1] */
    uint32_t order[GP_SLOTS_MAX]; /* slots, oldest image first; order[used] is the spare one */
    uint32_t made;                /* bit per slot: what is made from it is there */
    uint32_t bad;                 /* the last image had broken pixels */
    uint32_t measured;            /* the last call has measured it */
};

/* Of all blocks. */
struct gp_history_form {
    int window;       /* S */
    const char *what; /* for messages: "the history of" */
    /* What a slot holds of a block of this size; of: the member below. */
    struct gp_slot (*slot)(const void *of, int32_t width, int32_t height);
    const void *of;
};

struct gp_history_block {
    struct gp_head head, pending;
    struct lull_rect rect;
    struct gp_slot slot; /* of each image */
    size_t at;           /* where its slots begin in `bytes` */
};

struct gp_history {
    struct gp_history_form form;
    uint32_t count;                 /* blocks */
    struct gp_history_block *block; /* behind the slots */
    unsigned char *bytes;           /* owns all of it, as one allocation */
};

/* Bytes of one block with such slots. */
uint64_t gp_history_block_bytes(int window, struct gp_slot slot);
/* Copies form and rectangles of a checked frame. After LULL_E_MEMORY *history is zero. */
int32_t gp_history_create(struct gp_history *history, const struct gp_history_form *form, const struct lull_frame *frame,
                          struct lull_error *err);
/* Of the same blocks, with no image yet. */
int32_t gp_history_like(struct gp_history *fresh, const struct gp_history *history, struct lull_error *err);
/* *fresh, which was filled with this status, takes the place of *history; a failure releases it instead. */
int32_t gp_history_take(struct gp_history *history, struct gp_history *fresh, int32_t status);
void gp_history_release(struct gp_history *history);

/* Where a slot begins: `made` bytes, 64-byte aligned, and after them, aligned as far as `made` is, `kept` bytes. */
void *gp_history_made(const struct gp_history *h, uint32_t id, uint32_t slot);
void *gp_history_kept(const struct gp_history *h, uint32_t id, uint32_t slot);

/* Makes the spare slot that of the image which head->stopper has just accepted; returns the slot. `before`: images in the
 * window until then. */
uint32_t gp_head_push(struct gp_head *head, int window, uint32_t before);

#endif
