/*
 * Integer hashes and a small counter-based random stream. A number depends on the key and on how many were drawn before, and
 * on nothing else. By value, all inline; no shared state.
 */
#ifndef PT_SAMPLE_RNG_H
#define PT_SAMPLE_RNG_H

#include <stdint.h>

/* Largest float below 1. */
#define PT_ONE_BELOW 0x1.fffffep-1f

/* 32-bit finaliser with low bias, found by Chris Wellons' hash-prospector search (constants 0x21f0aaad, 0xd35a2d97). */
static inline uint32_t pt_hash32(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0xd35a2d97u;
    x ^= x >> 15;
    return x;
}

/* 64-bit finaliser of SplitMix64 (Stafford's variant 13). */
static inline uint64_t pt_hash64(uint64_t x)
{
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9u;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebu;
    x ^= x >> 31;
    return x;
}

/* The top 24 bits as a number in [0, 1). */
static inline float pt_bits_to_float(uint32_t bits) { return (float)(int32_t)(bits >> 8) * 0x1p-24f; }

/* For decisions whose number is not known in advance (null collisions, walks inside a coating, alpha): seeded from one
 * number of the path's sampler. SplitMix64 (Steele, Lea & Flood 2014). */
struct pt_rng {
    uint64_t state;
};
static inline struct pt_rng pt_rng_make(uint64_t key) { return (struct pt_rng){pt_hash64(key + 0x9e3779b97f4a7c15u)}; }
static inline uint32_t pt_rng_next(struct pt_rng *rng)
{
    rng->state += 0x9e3779b97f4a7c15u;
    return (uint32_t)(pt_hash64(rng->state) >> 32);
}
/* Uniform in [0, 1). */
static inline float pt_rng_float(struct pt_rng *rng) { return pt_bits_to_float(pt_rng_next(rng)); }

#endif
