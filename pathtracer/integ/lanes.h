/*
 * What is worked out for many paths of a run side by side, in the lanes of vectors. One source (lanes_body.h) is compiled
 * for several instruction sets (lanes_*.c); it calls the functions that single paths call: each returns the same bits.
 * Pure, thread-safe.
 */
#ifndef PT_INTEG_LANES_H
#define PT_INTEG_LANES_H

#include "integ/integrator.h"

/* What the numbers of a run's paths are made from (sample/sampler.h). */
struct pt_lane_keys {
    uint32_t pixel_key[PT_RUN], path_key[PT_RUN];
    uint32_t index_reversed; /* all paths of a run are the same sample of their pixels */
    int sobol;
};

/* Dimensions of a block that are wanted, a bit each. */
struct pt_lane_dims {
    uint32_t pairs;   /* as pt_sampler_2d, of this dimension and the next */
    uint32_t singles; /* as pt_sampler_1d */
    uint32_t bits;    /* as pt_bits_to_float of pt_sampler_bits */
};

struct pt_lanes {
    const char *name; /* "base", "avx2", "avx512" */
    /* u[d][i] for i < count: the number of dimension d of block `block` of path i. */
    void (*numbers)(const struct pt_lane_keys *keys, int count, uint32_t block, struct pt_lane_dims dims,
                    float (*u)[PT_RUN]);
};

/* Those of instruction set i, from 0 (the baseline), the weakest first; NULL where the processor or this build has none. */
enum { PT_LANES_COUNT = 3 };
const struct pt_lanes *pt_lanes_for(int i);

/* The best there are; the environment variable PT_ISA=base|avx2|avx512 lowers it. */
const struct pt_lanes *pt_lanes_best(void);

#endif
