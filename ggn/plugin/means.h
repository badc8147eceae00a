/*
 * What `observer` keeps of a frame whose host has no half buffers: of each block two earlier means, linear RGB in float.
 *
 * The running mean x1 at n1 samples and x2 at n2 > n1 hold what halves do: x2 - x1 has the variance s^2 (1/n1 - 1/n2) and
 * is uncorrelated with x2, so that (x2 - x1) sqrt(n1 / (n2 - n1)) replaces the half difference at n2. With n2 = 2 n1 it is
 * one. So the base, the mean that is compared with, is replaced whenever the samples have doubled; the mean in between is
 * the next base.
 *
 * One allocation per frame. A new mean goes into a spare slot and becomes part of the history only with gp_means_commit,
 * so that a failed call leaves no trace. Calls on different blocks may overlap; nothing else is thread-safe.
 */
#ifndef GGN_PLUGIN_MEANS_H
#define GGN_PLUGIN_MEANS_H

#include <stddef.h>
#include <stdint.h>

#include <lull/criterion.h>

struct gp_mean_head {
    uint64_t base, next; /* spp of the two means; 0: none */
    uint32_t slot[3];    /* of base, of next, the spare one */
};

struct gp_means {
    uint32_t count;                      /* blocks; 0: nothing is remembered */
    size_t values;                       /* of all blocks' single means */
    size_t *at;                          /* [count + 1]; where a block's slots begin, in values of single means */
    struct gp_mean_head *head, *pending; /* [count] */
    float *pixels;                       /* three slots of [3][P] of each block */
    void *memory;                        /* owns all of it */
};

/* For the blocks of a checked frame. LULL_E_MEMORY leaves *means as it was. */
int32_t gp_means_create(struct gp_means *means, const struct lull_frame *frame, struct lull_error *err);
void gp_means_release(struct gp_means *means);

/* Values of one mean of a block, [3][P]. */
size_t gp_means_values(const struct gp_means *means, uint32_t id);
/* Begins a check at spp >= 1 samples. *keep gets the [3][P] that the caller fills, if this mean is to be kept, else NULL.
 * Returns the mean to compare with and its samples, *spp_base < spp; NULL: there is none yet. The same spp again gets the
 * same mean. */
const float *gp_means_begin(struct gp_means *means, uint32_t id, uint64_t spp, float **keep, uint64_t *spp_base);
/* Makes a block's new mean part of the history. */
void gp_means_commit(struct gp_means *means, uint32_t id);

/* lull.state/1: all of it, checked on the way in. Writes and reads nothing where nothing is remembered. A refused state
 * leaves *means as it was. */
int32_t gp_means_save(const struct gp_means *means, const struct lull_writer *writer, struct lull_error *err);
int32_t gp_means_load(struct gp_means *means, const struct lull_reader *reader, struct lull_error *err);

#endif
