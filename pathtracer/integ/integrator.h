/*
 * What the renderer calls to get a sample of each of some pixels.
 *
 * A kernel is pure: its result depends on its arguments only, never on thread or what was rendered before, and that of a
 * pixel not on the other pixels, unless two surfaces coincide (integ/run.h). Any number of threads may call it at once.
 */
#ifndef PT_INTEG_INTEGRATOR_H
#define PT_INTEG_INTEGRATOR_H

#include <stdint.h>
#include <stdio.h>

#include "scene/effects.h"
#include "scene/materials.h"
#include "scene/settings.h"
#include "scene/vec.h"

struct pt_scene;

struct pt_path_result {
    pt_vec3 radiance;     /* linear Rec.709 RGB after the film's exposure scale; may be non-finite: the film decides */
    pt_vec3 albedo;       /* first non-specular surface: directional-hemispherical reflectance estimate in [0,1] */
    pt_vec3 normal_world; /* shading normal there, facing the ray */
    float depth;          /* distance along the camera ray to the first hit, scene units; INFINITY when none */
    uint32_t rays;        /* intersection and occlusion queries */
};

/* The most paths that a kernel traces together. */
enum { PT_RUN = 64 };

/* Sample `sample` (from 0) of the pixels (x, y) … (x + count - 1, y) of the full image, whatever the crop; out: [count],
 * 1 <= count <= PT_RUN. */
typedef void pt_kernel(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                       uint32_t sample, struct pt_path_result *out);

/* The smallest compiled kernel that covers `needed`; *covers (may be NULL) gets its effect set, *name a static name. */
pt_kernel *pt_kernel_select(pt_effects needed, pt_effects *covers, const char **name);

/* What the vertices of paths are: a scattering model each, or a collision in a medium. */
enum { PT_MET_MEDIUM = PT_BSDF_COUNT, PT_MET_COUNT };

/* One path vertex by vertex: in words on `out` (--debug-path), and added to met[PT_MET_COUNT]; either may be NULL. Slower
 * than the other kernels. */
void pt_kernel_trace(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                     uint32_t sample, FILE *out, uint64_t *met);

#endif
