#include "nn/exec.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/exec.inc"
