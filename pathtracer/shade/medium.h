/*
 * Participating media along a ray: where it scatters, what gets through, what is emitted.
 *
 * Rays are origin + t · direction with unit direction in render space, t in scene units. Functions are pure but for the
 * caller's random stream and the counter below; thread-safe.
 */
#ifndef PT_SHADE_MEDIUM_H
#define PT_SHADE_MEDIUM_H

#include "base/err.h"
#include "sample/rng.h"
#include "scene/scene.h"

/* Number of calls of this thread into medium code so far: lets tests prove that scenes without media make none. */
extern _Thread_local unsigned long long pt_medium_queries;

struct pt_medium_event {
    int32_t scattered; /* 1: a collision scatters at t < t_max; 0: t_max was reached */
    float t;
    pt_vec3 weight;  /* factor on the path's throughput: σs T / p or T / p; black: the path is over */
    pt_vec3 emitted; /* radiance emitted towards the origin along the way, to be multiplied by the throughput before it */
};

/* Makes the majorants of grid media in the scene's arena. Call once after media are filled. */
int pt_media_build(struct pt_scene *scene, struct base_err *err);

/* Samples the distance to the next scattering within [0, t_max]; t_max may be INFINITY. Media that only absorb use no random
 * number and never scatter. `throughput` of the path so far, not black: colours are followed as far as they count in it. */
void pt_medium_sample_distance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                               pt_vec3 throughput, struct pt_rng *rng, struct pt_medium_event *event);

/* Transmittance over [0, t_max]: exact for homogeneous media, an unbiased estimate in [0, 1] for grids. */
pt_vec3 pt_medium_transmittance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                                struct pt_rng *rng);

/* Density of a grid at p in its unit box: trilinear between cell centres, 0 outside. */
float pt_medium_density(const struct pt_medium *medium, pt_vec3 p_grid);

/* Grid media, in medium_grid.c; the functions above forward to these. */
void pt_medium_grid_sample(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                           pt_vec3 throughput, struct pt_rng *rng, struct pt_medium_event *event);
pt_vec3 pt_medium_grid_transmittance(const struct pt_medium *medium, pt_vec3 origin, pt_vec3 direction, float t_max,
                                     struct pt_rng *rng);
int pt_medium_grid_build(struct pt_medium *medium, struct pt_arena *arena, struct base_err *err);

#endif
