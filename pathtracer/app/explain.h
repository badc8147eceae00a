/* --explain: the effects that a scene calls for, why, and what they cost. */
#ifndef PT_EXPLAIN_H
#define PT_EXPLAIN_H

#include "pbrt/load_options.h"
#include "scene/scene.h"

/* Prints the table to stdout. Times a few thousand paths (about a second) with the chosen kernel and with the general one;
 * scene_path is for the heading. Not reentrant with other output to stdout. */
void pt_explain(const struct pt_scene *scene, const struct pt_scene_defaults *defaults,
                const struct pt_integrator *integrator, const char *scene_path);

#endif
