/* Builds the hierarchy of emitters: top down, by the surface area orientation heuristic (Conty Estevez & Kulla 2018). */
#ifndef PT_SHADE_LIGHT_TREE_BUILD_H
#define PT_SHADE_LIGHT_TREE_BUILD_H

#include "scene/scene.h"

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

/* Makes tree->nodes and tree->places in `arena` from bounds[count], which it sorts, of `emitter_count` emitters in all;
 * `smallest` > 0 is the least radius of a node. `scratch` may be released afterwards. 0 when out of memory. */
int pt_light_tree_build(struct pt_light_tree *tree, struct pt_light_bounds *bounds, int32_t count, int32_t emitter_count,
                        float smallest, struct pt_arena *arena, struct pt_arena *scratch);

#endif
