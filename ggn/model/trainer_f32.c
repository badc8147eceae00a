#include "model/trainer.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "model/trainer.inc"
