/*
 * Made-up block sequences with known noise, for tests: a smooth picture with optional texture, grey Gaussian noise of a given standard
 * deviation per sample, nested levels of two equal halves, an independent reference, and the statistics that a film would give.
 */
#ifndef TESTS_GGN_NOISE_H
#define TESTS_GGN_NOISE_H

#include <stdint.h>

#include "sequence/block.h"

struct ggn_noise {
    uint32_t width, height;
    const uint32_t *levels;
    uint32_t n_levels, reference_spp; /* 0: no reference */
    double sigma, texture;
    uint32_t seed;
    double tail; /* the statistics tail999 (this at one sample) and gini are recorded; 0: they are not */
};

uint32_t ggn_noise_hash(uint32_t k, uint32_t s);
double ggn_noise_gauss(uint32_t k, uint32_t s);

/* Builds the block; the caller releases. Fails the running test when it cannot. */
struct seq_block ggn_noise_block(const struct ggn_noise *noise);

/* Writes DIR (made if missing) with one block per sigma[i], in a row, and labels where noise of sigma^2 stops being visible:
 * threshold = samples_per_variance * sigma^2, censored at the last level. */
void ggn_noise_view(const char *dir, const char *scene, const struct ggn_noise *noise, const double *sigma, int n,
                    double samples_per_variance);

#endif
