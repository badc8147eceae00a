/* The kernels for any processor: vectors of 16 bytes through the compiler's vector extension. */
#include "nn/bf16.h"
#include "nn/real.h"

#ifndef GGN_DOUBLE
#define FASTER_FORMS .bf16 = ggn_bf16_conv, .bf16_pack = ggn_bf16_pack,
#endif
#include "nn/kernels_body.h"
