/* The pbrt directives: reads scene text and feeds the builder. */
#ifndef PT_PBRT_PBRT_H
#define PT_PBRT_PBRT_H

#include "pbrt/build.h"

/* Reads `path` and all that it includes; on success the builder is ready for pt_builder_finish. */
int pt_pbrt_read(struct pt_builder *b, const char *path);

#endif
