/* The functions of struct pt_lanes for one instruction set; lanes_NAME.c includes this with PT_LANES_NAME defined. Loops
 * without branches over arrays, which the compiler turns into vectors. */
#include "integ/lanes.h"
#include "sample/sampler.h"

#define PT_LANES_JOIN(a, b) a##b
#define PT_LANES_TABLE(name) PT_LANES_JOIN(pt_lanes_, name)
#define PT_LANES_TEXT_OF(name) #name
#define PT_LANES_TEXT(name) PT_LANES_TEXT_OF(name)

static void sobol_pair(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x, float *restrict y)
{
    struct pt_sampler s = {.index_reversed = keys->index_reversed};
    for (int i = 0; i < count; i++) {
        s.pixel_key = keys->pixel_key[i];
        struct pt_sample2 u = pt_sobol_pair(&s, dim);
        x[i] = u.x;
        y[i] = u.y;
    }
}

static void sobol_single(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x)
{
    struct pt_sampler s = {.index_reversed = keys->index_reversed};
    for (int i = 0; i < count; i++) {
        s.pixel_key = keys->pixel_key[i];
        x[i] = pt_sobol_pair(&s, dim).x;
    }
}

static void hashed(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x)
{
    struct pt_sampler s = {0};
    for (int i = 0; i < count; i++) {
        s.path_key = keys->path_key[i];
        x[i] = pt_bits_to_float(pt_sampler_bits(&s, dim));
    }
}

static void numbers(const struct pt_lane_keys *keys, int count, uint32_t block, struct pt_lane_dims dims, float (*u)[PT_RUN])
{
    const uint32_t base = block * PT_DIMS_PER_VERTEX;
    const int sobol = keys->sobol && block < PT_SOBOL_BLOCKS;
    for (uint32_t d = 0; d < PT_DIMS_PER_VERTEX; d++) {
        const uint32_t pair = dims.pairs >> d & 1, single = dims.singles >> d & 1;
        if (sobol && pair) {
            sobol_pair(keys, count, base + d, u[d], u[d + 1]);
        } else if (sobol && single) {
            sobol_single(keys, count, base + d, u[d]);
        } else if (pair | single | (dims.bits >> d & 1)) {
            hashed(keys, count, base + d, u[d]);
            if (pair)
                hashed(keys, count, base + d + 1, u[d + 1]);
        }
    }
}

extern const struct pt_lanes PT_LANES_TABLE(PT_LANES_NAME);
const struct pt_lanes PT_LANES_TABLE(PT_LANES_NAME) = {PT_LANES_TEXT(PT_LANES_NAME), numbers};
