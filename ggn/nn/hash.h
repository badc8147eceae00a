/* The hash of the golden values, also the library's random numbers: h(k, s), and u(k, s) = h / 2^32 in [0, 1). */
#ifndef GGN_NN_HASH_H
#define GGN_NN_HASH_H

#include <stdint.h>

uint32_t ggn_hash(uint32_t k, uint32_t s);
double ggn_hash_unit(uint32_t k, uint32_t s);

#endif
