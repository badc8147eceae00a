/*
 * What the renderer calls to get one sample of one pixel.
 *
 * A kernel is pure: its result depends on the scene, the settings and (pixel, sample) only, never on thread, block, or what
 * was rendered before. Any number of threads may call it at once.
 */
#ifndef PT_INTEG_INTEGRATOR_H
#define PT_INTEG_INTEGRATOR_H

#include <stdint.h>

#include "scene/vec.h"
#include "scene/effects.h"

struct pt_scene;

enum pt_sampler_kind { PT_SAMPLER_INDEPENDENT, PT_SAMPLER_SOBOL };
enum pt_strategy {
    PT_STRATEGY_MIS,      /* next-event estimation and BSDF sampling, balance or power heuristic */
    PT_STRATEGY_BSDF_ONLY /* brute force: emission is met by BSDF sampling only; the oracle of tests */
};
enum pt_filter_kind { PT_FILTER_BOX, PT_FILTER_TRIANGLE, PT_FILTER_GAUSSIAN };

struct pt_integrator {
    int32_t max_depth;      /* most surface/medium bounces; < 0 = unlimited */
    int32_t rr_depth;       /* Russian roulette from this bounce on */
    int32_t sampler;        /* enum pt_sampler_kind */
    int32_t strategy;       /* enum pt_strategy */
    int32_t filter;         /* enum pt_filter_kind: sampled by importance, so no sample touches a neighbouring pixel */
    float filter_x, filter_y; /* radii in pixels; 0.5 = box of one pixel */
    float filter_sigma;     /* Gaussian only, pixels */
    float max_component;    /* radiance clamp of one sample (pbrt maxcomponentvalue); INFINITY = none */
    uint32_t seed;
    int32_t want_aux;       /* fill albedo, normal_world, depth */
};

struct pt_path_result {
    pt_vec3 radiance;      /* linear Rec.709 RGB after the film's exposure scale; may be non-finite: the film decides */
    pt_vec3 albedo;        /* first non-specular surface: directional-hemispherical reflectance estimate in [0,1] */
    pt_vec3 normal_world;  /* shading normal at the first hit, facing the camera */
    float depth;           /* distance along the camera ray to the first hit, scene units; INFINITY when none */
    uint32_t rays;         /* intersection and occlusion queries */
};

/* (x, y): pixel of the full image, whatever the crop; sample: index from 0. */
typedef void pt_kernel(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                       uint32_t sample, struct pt_path_result *out);

/* The smallest compiled kernel that covers `needed`; *covers (may be NULL) gets its effect set, *name a static name. */
pt_kernel *pt_kernel_select(pt_effects needed, pt_effects *covers, const char **name);

/* One path vertex by vertex in words on `out` (--debug-path). */
int pt_kernel_trace(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                    uint32_t sample, void (*line)(void *data, const char *text), void *data);

#endif
