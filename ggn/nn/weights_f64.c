#include "nn/exec.h"
#include "nn/weights.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/weights.inc"
