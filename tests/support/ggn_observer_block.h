/* Blocks of known noise that the tests of the model observer look at. */
#ifndef TESTS_SUPPORT_GGN_OBSERVER_BLOCK_H
#define TESTS_SUPPORT_GGN_OBSERVER_BLOCK_H

#include <stdint.h>

#include "support/ggn_noise.h"

enum { W = 96, H = 80, P = W * H, LEVELS = 16 };

static const uint32_t levels[LEVELS] = {20, 30, 45, 68, 101, 152, 228, 342, 513, 769, 1153, 1730, 2595, 3892, 5839, 8758};

static inline struct seq_block make_block(double sigma, double texture, uint32_t seed, uint32_t reference_spp)
{
    struct ggn_noise n = {W, H, levels, LEVELS, reference_spp, sigma, texture, seed, 0};
    return ggn_noise_block(&n);
}

#endif
