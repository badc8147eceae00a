/* What lights need before rendering: emitters to select from, by power or by a hierarchy; tables of environment images. */
#ifndef PT_SHADE_LIGHT_BUILD_H
#define PT_SHADE_LIGHT_BUILD_H

#include "base/err.h"
#include "scene/scene.h"

/* Makes emitters, env_lights and env_distributions in the scene's arena, after pt_accel_build (it needs the bounds). */
int pt_lights_build(struct pt_scene *scene, struct base_err *err);

/* Walker's alias method with Vose's linear-time construction (1991), from n >= 1 weights (>= 0, finite, sum > 0): pick
 * i = floor(u·n), keep it when frac(u·n) < alias_q, else take its alias. `work` is scratch of n values. */
void pt_alias_build(const double *weights, int32_t n, struct pt_emitter *emitters, int32_t *work);

/* What the hierarchy knows of an emitter. */
struct pt_light_bounds {
    int32_t emitter; /* id */
    int32_t two_sided;
    pt_vec3 lower, upper; /* finite */
    pt_vec3 axis;         /* unit: of the cone around its normals */
    float normals_rad;    /* half angle of that cone, π = any direction */
    float emission_rad;   /* nothing is emitted further than this off a normal */
    double intensity;     /* > 0: luminance times projected area, greatest over directions */
};

/* Makes the hierarchy, top down by the surface area orientation heuristic (Conty Estevez & Kulla 2018): tree->nodes and
 * tree->places in `arena` from bounds[count], which it sorts, of `emitter_count` emitters in all; `smallest` > 0 is the
 * least radius of a node. `scratch` may be released afterwards. 0 when out of memory. */
int pt_light_tree_build(struct pt_light_tree *tree, struct pt_light_bounds *bounds, int32_t count, int32_t emitter_count,
                        float smallest, struct pt_arena *arena, struct pt_arena *scratch);

#endif
