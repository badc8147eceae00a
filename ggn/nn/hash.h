/* The hash of the golden values, also the library's random numbers: h(k, s), and u(k, s) = h / 2^32 in [0, 1). */
#ifndef GGN_NN_HASH_H
#define GGN_NN_HASH_H

#include <stdint.h>

static inline uint32_t ggn_hash(uint32_t k, uint32_t s)
{
    uint32_t h = k + s * 0x9E3779B9u;

    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

static inline double ggn_hash_unit(uint32_t k, uint32_t s) { return ggn_hash(k, s) / 4294967296.0; }

#endif
