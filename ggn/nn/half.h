/* Floats of 16 bits: IEEE 754 binary16 (f16) and bfloat16, the upper half of a float. */
#ifndef GGN_NN_HALF_H
#define GGN_NN_HALF_H

#include <stdint.h>

/* Rounds to nearest even; NaN stays NaN. */
uint16_t ggn_f32_to_bf16(float x);
float ggn_bf16_to_f32(uint16_t x);
uint16_t ggn_f32_to_f16(float x);
float ggn_f16_to_f32(uint16_t x);

#endif
