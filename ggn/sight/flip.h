/*
 * LDR-FLIP: the visible difference of two display images when one alternates between them.
 *
 * Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for Alternating Images",
 * HPG 2020. Values in [0,1]. Thread-safe: no state.
 */
#ifndef GGN_OBSERVER_FLIP_H
#define GGN_OBSERVER_FLIP_H

#include <stdint.h>

#include "base/err.h"

/* 0.7 m from a 0.7 m wide screen of 3840 pixels: the paper's default viewing condition. */
#define GGN_FLIP_PPD 67.02064327657925

struct ggn_flip_stats {
    double mean, max;
};

/* reference, test: [height][width][3], sRGB 8 bit. map (may be NULL): [height][width] gets the error per pixel. */
int ggn_flip(const uint8_t *reference, const uint8_t *test, int width, int height, double pixels_per_degree, float *map,
             struct ggn_flip_stats *stats, struct base_err *err);

#endif
