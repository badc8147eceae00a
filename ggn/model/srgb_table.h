/* The sRGB curve as a table; Private to ggn/model. */
#ifndef GGN_MODEL_SRGB_TABLE_H
#define GGN_MODEL_SRGB_TABLE_H

#include <stdint.h>

/* Bits of the smallest float in the first bin; bins are 2^16 bit patterns wide and end at 1. */
#define GGN_SRGB_FIRST_BITS 0x391f0000u

/* [code]: bits of the smallest float whose 8-bit sRGB value is `code` (round half up). [256] is never reached. */
extern const uint32_t ggn_srgb_limit[257];
/* The code at the start of each bin. */
extern const uint8_t ggn_srgb_bin[1633];

#endif
