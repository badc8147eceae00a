#include "nn/loss.h"

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "nn/ssim.inc"
