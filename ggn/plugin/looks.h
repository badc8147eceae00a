/*
 * What `observer` remembers of a frame whose host has no half buffers: of each block two earlier looks, linear RGB in float.
 *
 * A look x1 at n1 samples and one x2 at n2 > n1 of the same running mean carry what halves do: x2 - x1 has the variance
 * s^2 (1/n1 - 1/n2) and is uncorrelated with x2, so that (x2 - x1) sqrt(n1 / (n2 - n1)) stands in for the half difference at
 * n2. With n2 = 2 n1 it is one. So the base, the look that is compared with, is replaced whenever the samples have doubled;
 * the look in between waits for its turn.
 *
 * One allocation per frame. A new look goes into a spare slot and becomes part of the history only with gp_looks_commit,
 * so that a failed call leaves no trace. Calls on different blocks may overlap; nothing else is thread-safe.
 */
#ifndef GGN_PLUGIN_LOOKS_H
#define GGN_PLUGIN_LOOKS_H

#include <stddef.h>
#include <stdint.h>

#include <lull/criterion.h>

struct gp_look_head {
    uint64_t base, next; /* spp of the two looks; 0: none */
    uint32_t slot[3];    /* of base, of next, the spare one */
};

struct gp_looks {
    uint32_t count;                      /* blocks; 0: nothing is remembered */
    size_t values;                       /* of all blocks' single looks */
    size_t *at;                          /* [count + 1]; where a block's slots begin, in values of single looks */
    struct gp_look_head *head, *pending; /* [count] */
    float *pixels;                       /* three slots of [3][P] of each block */
    void *memory;                        /* owns all of it */
};

/* For the blocks of a checked frame. LULL_E_MEMORY leaves *looks as it was. */
int32_t gp_looks_create(struct gp_looks *looks, const struct lull_frame *frame, struct lull_error *err);
void gp_looks_release(struct gp_looks *looks);

/* Values of one look of a block, [3][P]. */
size_t gp_looks_values(const struct gp_looks *looks, uint32_t id);
/* Begins a look at spp >= 1 samples. *keep gets the [3][P] that the caller fills, if this look is to be remembered, else
 * NULL. Returns the look to compare with and its samples, *spp_base < spp; NULL: there is none yet. The same spp again gets
 * the same look. */
const float *gp_looks_begin(struct gp_looks *looks, uint32_t id, uint64_t spp, float **keep, uint64_t *spp_base);
/* Makes a block's look part of the history. */
void gp_looks_commit(struct gp_looks *looks, uint32_t id);

/* lull.state/1: all of it, checked on the way in. Writes and reads nothing where nothing is remembered. A refused state
 * leaves *looks as it was. */
int32_t gp_looks_save(const struct gp_looks *looks, const struct lull_writer *writer, struct lull_error *err);
int32_t gp_looks_load(struct gp_looks *looks, const struct lull_reader *reader, struct lull_error *err);

#endif
