/*
 * What is worked out for many paths of a run side by side, in the lanes of vectors. One source (lanes_body.h) is compiled
 * for several instruction sets (lanes_*.c); it calls the functions that single paths call: each returns the same bits.
 * Pure, thread-safe.
 */
#ifndef PT_INTEG_LANES_H
#define PT_INTEG_LANES_H

#include "base/isa.h"
#include "integ/integrator.h"

/* Vectors side by side. */
struct pt_lane_vec3 {
    float x[PT_RUN], y[PT_RUN], z[PT_RUN];
};

static inline pt_vec3 pt_lane_get(const struct pt_lane_vec3 *from, int i)
{
    return (pt_vec3){from->x[i], from->y[i], from->z[i]};
}

static inline void pt_lane_put(struct pt_lane_vec3 *to, int i, pt_vec3 value)
{
    to->x[i] = value.x;
    to->y[i] = value.y;
    to->z[i] = value.z;
}

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

/* Where paths have met diffuse surfaces, and emitters that were selected there: triangles. */
struct pt_lane_hits {
    struct pt_lane_vec3 p, error, n_geometric, n_shading, reflectance; /* struct pt_place, struct pt_bsdf */
    struct pt_lane_vec3 p0, e1, e2, n, side, emission;                 /* struct pt_emitter, struct pt_light; … */
    float area_over_pmf[PT_RUN];                                       /* … 0: none */
    float by_tree[PT_RUN]; /* probability of the selection by power over that with which the emitter was selected */
    int32_t two_sided[PT_RUN];
};

/* The paths of a run that are under way. In: the rays that made the hits, and throughputs. Out: what comes next. */
struct pt_lane_paths {
    _Alignas(64) struct pt_lane_vec3 origin, direction; /* ray; from `origin` of the hit on, unit */
    struct pt_lane_vec3 throughput;
    float pdf_prev[PT_RUN];
    struct pt_lane_vec3 prev_p, prev_n;                              /* struct pt_receiver */
    struct pt_lane_vec3 shadow_origin, shadow_direction, shadow_add; /* struct pt_light_plan */
    int32_t alive[PT_RUN];                                           /* the path goes on */
};

struct pt_lanes {
    /* u[d][i] for i < count: the number of dimension d of block `block` of path i. */
    void (*numbers)(const struct pt_lane_keys *keys, int count, uint32_t block, struct pt_lane_dims dims,
                    float (*u)[PT_RUN]);
    /* Light and the next direction at diffuse surfaces: pt_path_bounce (path.h) of the first `count` paths. u: the vertex's
     * numbers; roulette: whether it takes part in who is alive, `keep_most` the most that it keeps. */
    void (*bounce)(const struct pt_lane_hits *hits, float (*u)[PT_RUN], int count, int roulette, float keep_most,
                   struct pt_lane_paths *paths);
};

/* Those of an instruction set; NULL where the processor or this build has none. */
const struct pt_lanes *pt_lanes_for(enum base_isa isa);

/* Those of base_isa_best(). */
const struct pt_lanes *pt_lanes_best(void);

#endif
