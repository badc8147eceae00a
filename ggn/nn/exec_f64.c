#include "nn/exec.h"
#include "nn/bf16.h"
#include "nn/winograd.h"

#define REAL_IS_FLOAT 0
#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/exec.inc"
