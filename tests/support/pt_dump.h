/* A loaded scene as text: every field that is not zero, one thing a line. For comparison with a recorded text. */
#ifndef TESTS_SUPPORT_PT_DUMP_H
#define TESTS_SUPPORT_PT_DUMP_H

#include <stdio.h>

#include "pbrt/load.h"

/* Film, filter, sampler, integrator and camera. */
void pt_dump_header(FILE *out, const struct pt_scene *scene, const struct pt_scene_defaults *defaults);
/* All the rest. Of long arrays a part, and a weighted sum of all. */
void pt_dump_world(FILE *out, const struct pt_scene *scene);

#endif
