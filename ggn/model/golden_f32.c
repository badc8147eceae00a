#include "model/trainer.h"
#include "model/golden.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "model/golden.inc"
