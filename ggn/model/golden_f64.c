#include "model/trainer.h"
#include "model/golden.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "model/golden.inc"
