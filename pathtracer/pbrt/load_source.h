/* pt_scene_load with the bytes from elsewhere than the disk: for tests and fuzzers. */
#ifndef PT_PBRT_LOAD_SOURCE_H
#define PT_PBRT_LOAD_SOURCE_H

#include "pbrt/load.h"
#include "pbrt/source.h"

int pt_scene_load_source(const char *path, const struct pt_source *source, const struct pt_load_options *options,
                         struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err);

#endif
