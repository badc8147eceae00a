#include "nn/exec.h"
#include "nn/bf16.h"
#include "nn/winograd.h"

#define REAL_IS_FLOAT 1
#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/exec.inc"
