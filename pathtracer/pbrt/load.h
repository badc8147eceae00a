/*
 * From a scene file to something that can be rendered: the only way in for the renderer.
 */
#ifndef PT_PBRT_LOAD_H
#define PT_PBRT_LOAD_H

#include "base/err.h"
#include "pbrt/load_options.h"
#include "pbrt/source.h"
#include "scene/scene.h"

/* Loads `path` and builds it for rendering. On failure (BASE_EINVAL: err has `file:line:column: what is wrong`) *out is
 * untouched and nothing is left allocated. The scene is read-only afterwards and may be used from any thread. */
int pt_scene_load(const char *path, const struct pt_load_options *options, struct pt_scene **out,
                  struct pt_scene_defaults *defaults, struct base_err *err);
/* The same with the bytes from elsewhere than the disk: for tests and fuzzers. */
int pt_scene_load_source(const char *path, const struct pt_source *source, const struct pt_load_options *options,
                         struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err);
void pt_scene_destroy(struct pt_scene *scene);

#endif
