/* What lights need before rendering: the emitters to select from, tables of environment images. */
#ifndef PT_SHADE_LIGHT_BUILD_H
#define PT_SHADE_LIGHT_BUILD_H

#include "base/err.h"
#include "scene/scene.h"

/* Makes emitters, env_lights and env_distributions in the scene's arena, after pt_accel_build (it needs the bounds). */
int pt_lights_build(struct pt_scene *scene, struct base_err *err);

#endif
