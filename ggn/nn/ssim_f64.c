#include "nn/loss.h"

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "nn/ssim.inc"
