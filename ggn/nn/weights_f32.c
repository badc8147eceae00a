#include "nn/exec.h"
#include "nn/weights.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/weights.inc"
