/*
 * Lights: selection, sampling towards a point, emission met by chance, and the densities that multiple importance sampling
 * needs for both. All densities are per solid angle at the reference point and include the probability of the selection.
 * Pure, thread-safe, no allocation (but for pt_lights_build).
 */
#ifndef PT_SHADE_LIGHT_H
#define PT_SHADE_LIGHT_H

#include "base/err.h"
#include "scene/scene.h"

/* Makes emitters, env_lights and env_distributions in the scene's arena, after pt_accel_build (it needs the bounds). */
int pt_lights_build(struct pt_scene *scene, struct pt_err *err);

#endif
