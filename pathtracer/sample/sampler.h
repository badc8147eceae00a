/*
 * The numbers of one path. A number depends on (seed, pixel, sample, dimension) and on nothing else, so a kernel that skips
 * an effect still gives every other effect the same numbers. Plain value, inline, one per path; no allocation, no locking.
 *
 * Dimensions come in blocks of PT_DIMS_PER_VERTEX: block 0 is the camera, block k + 1 the k-th vertex.
 *
 * - Independent: a hash of (path key, dimension).
 * - Sobol: the first two Sobol' dimensions, padded. Every pair of dimensions has its own Owen shuffle of the sample index
 *   and its own Owen scrambles (Burley 2020, "Practical Hash-based Owen Scrambling"). Blocks beyond PT_SOBOL_BLOCKS get
 *   independent numbers: stratification no longer shows there and costs time.
 *
 * A pixel's even samples are one sequence and its odd ones another, independent of it. So they are halves whose difference
 * tells the noise of their mean. Halves of one sequence have errors of opposite sign: their difference overstates the noise
 * (by 1.3 to 1.4 in scenes/cornell-box.pbrt), and one half is no neutral judge of what is made of the other.
 */
#ifndef PT_SAMPLE_SAMPLER_H
#define PT_SAMPLE_SAMPLER_H

#include <stdint.h>

#include "sample/rng.h"

enum { PT_DIMS_PER_VERTEX = 16, PT_SOBOL_BLOCKS = 3 };
/* Changes whenever the numbers do: samples of two versions must not meet in one pixel. */
enum { PT_SAMPLER_VERSION = 2 };

enum pt_camera_dim { PT_DIM_PIXEL = 0, PT_DIM_LENS = 2, PT_DIM_TIME = 4 };
enum pt_vertex_dim {
    PT_DIM_BSDF = 0,       /* pair: direction */
    PT_DIM_LIGHT = 2,      /* pair: point on the light */
    PT_DIM_LIGHT_PICK = 4, /* which emitter */
    PT_DIM_BSDF_LOBE = 5,
    PT_DIM_ROULETTE = 6,
    PT_DIM_MEDIUM = 7,       /* distance, or the key of a null-collision stream */
    PT_DIM_PHASE = 8,        /* pair */
    PT_DIM_ALPHA = 10,       /* key of the stream for pass-through decisions of the scattered ray */
    PT_DIM_SHADOW = 11,      /* key: alpha and transmittance of the shadow ray */
    PT_DIM_MIX = 12,         /* key: choice of mix materials, walks inside coatings */
    PT_DIM_BSDF_WALK = 13,   /* key: streams inside bsdf evaluation */
    PT_DIM_CONTACT = 14,     /* key: alpha that the shadow ray meets at the place that it begins at, … */
    PT_DIM_CONTACT_LAMP = 15 /* … and at that of the lamp */
};

struct pt_sampler {
    uint32_t index_reversed; /* Sobol: index in the sample's sequence, bits reversed */
    uint32_t sobol;
    uint32_t base;      /* first dimension of the current block */
    uint32_t pixel_key; /* of (seed, pixel, sequence) */
    uint32_t path_key;  /* of (seed, pixel, sample) */
};

static inline uint32_t pt_reverse_bits(uint32_t x)
{
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/* Hash whose every bit depends on lower bits only: on reversed bits, an Owen scramble. Constants: N. Vegdahl's improvement
 * (2021) of Laine & Karras 2011. */
static inline uint32_t pt_owen_hash(uint32_t x, uint32_t seed)
{
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/* Second Sobol' dimension of a sample, as a 32-bit fraction with its bits reversed; the first one is the index itself. Its
 * matrix is Pascal's triangle mod 2, an entry set when the bits of one index are among those of the other (Lucas), so the
 * product is five steps of an xor over subsets. */
static inline uint32_t pt_sobol_second(uint32_t index)
{
    index ^= (index & 0xaaaaaaaau) >> 1;
    index ^= (index & 0xccccccccu) >> 2;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= index >> 16;
    return index;
}

/* sobol: 0 = independent. */
static inline struct pt_sampler pt_sampler_make(int sobol, uint32_t seed, uint32_t x, uint32_t y, uint32_t sample)
{
    uint64_t pixel_key = pt_hash64(((uint64_t)y << 32 | x) + 0x9e3779b97f4a7c15u * ((uint64_t)seed + 1));
    uint32_t path_key = (uint32_t)(pt_hash64(pixel_key + 0xd1342543de82ef95u * ((uint64_t)sample + 1)) >> 16);
    uint32_t sequence_key = (uint32_t)(pixel_key >> (sample & 1 ? 0 : 32));
    return (struct pt_sampler){pt_reverse_bits(sample >> 1), sobol != 0, 0, sequence_key, path_key};
}

/* Moves to block `block` (0 = camera, k + 1 = vertex k). */
static inline void pt_sampler_block(struct pt_sampler *s, uint32_t block) { s->base = block * PT_DIMS_PER_VERTEX; }

static inline uint32_t pt_sampler_bits(const struct pt_sampler *s, uint32_t dim)
{
    return pt_hash32(s->path_key + 0x9e3779b9u * (s->base + dim));
}

struct pt_sample2 {
    float x, y;
};

/* The shuffled index, reversed, is the first dimension, but no scramble of it: within a prefix of 2^m samples all its bits
 * beyond the m-th are the same, so that each stratum would have its sample at the same place. */
static inline struct pt_sample2 pt_sobol_pair(const struct pt_sampler *s, uint32_t dim)
{
    uint32_t seed = pt_hash32(s->pixel_key + 0x9e3779b9u * dim);
    uint32_t shuffled = pt_reverse_bits(pt_owen_hash(s->index_reversed, seed));
    uint32_t x = pt_reverse_bits(pt_owen_hash(shuffled, seed * 0x9c8f2d35u + 0x6a09e667u));
    uint32_t y = pt_reverse_bits(pt_owen_hash(pt_sobol_second(shuffled), seed * 0x2c1b3c6du + 0x297a2d39u));
    return (struct pt_sample2){pt_bits_to_float(x), pt_bits_to_float(y)};
}

/* Two numbers in [0, 1) stratified together; dim is even, relative to the block. */
static inline struct pt_sample2 pt_sampler_2d(const struct pt_sampler *s, uint32_t dim)
{
    if (s->sobol && s->base < PT_SOBOL_BLOCKS * PT_DIMS_PER_VERTEX)
        return pt_sobol_pair(s, s->base + dim);
    return (struct pt_sample2){pt_bits_to_float(pt_sampler_bits(s, dim)), pt_bits_to_float(pt_sampler_bits(s, dim + 1))};
}

static inline float pt_sampler_1d(const struct pt_sampler *s, uint32_t dim)
{
    if (s->sobol && s->base < PT_SOBOL_BLOCKS * PT_DIMS_PER_VERTEX)
        return pt_sobol_pair(s, s->base + dim).x;
    return pt_bits_to_float(pt_sampler_bits(s, dim));
}

/* A stream for decisions of unknown number, keyed by dimension `dim` of this path. */
static inline struct pt_rng pt_sampler_stream(const struct pt_sampler *s, uint32_t dim)
{
    return pt_rng_make((uint64_t)s->path_key << 32 | (s->base + dim));
}

#endif
