/*
 * Random numbers of tests: SplitMix64 (Steele, Lea, Flood 2014). The state is the seed; the same seed gives the same numbers
 * on every machine (gauss: as far as its logarithm and cosine do).
 */
#ifndef TESTS_SPLITMIX_H
#define TESTS_SPLITMIX_H

#include <math.h>
#include <stdint.h>

/* In (0, 1). */
static inline double splitmix_uniform(uint64_t *state)
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

/* Normal, mean 0, deviation 1 (Box and Muller 1958). */
static inline double splitmix_gauss(uint64_t *state)
{
    const double radius = sqrt(-2 * log(splitmix_uniform(state)));
    return radius * cos(6.283185307179586 * splitmix_uniform(state));
}

#endif
