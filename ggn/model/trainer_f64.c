#include "model/trainer.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "model/trainer.inc"
