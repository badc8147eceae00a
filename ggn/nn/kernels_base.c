/* The kernels for any processor: vectors of 16 bytes through the compiler's vector extension. */
#include "nn/real.h"

#include "nn/kernels_body.h"
