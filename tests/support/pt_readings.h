/* What the path tracer and the recorder read: scenes, meshes, textures, checkpoints, sequences. */
#ifndef TESTS_SUPPORT_PT_READINGS_H
#define TESTS_SUPPORT_PT_READINGS_H

#include "support/base_reading.h"

enum { PT_READINGS = 15 };
extern const struct base_reading pt_readings[PT_READINGS];

#endif
