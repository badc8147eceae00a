/*
 * The pictures of one recorded block that people are shown:
 *
 * - the converged one;
 * - the recorded levels;
 * - beyond the last level, or without a reference at all of 20, 23, ... 10,000 spp (each 1.15 times the one before), levels
 *   made from the two halves: the converged picture + sqrt(spp0 / n) times the half-buffer difference at spp0.
 *
 * A reference of n_r independent samples has noise of its own: I_n - R has the variance s^2 (1/n + 1/n_r), not s^2/n.
 * Scaling that linear difference by sqrt(n_r/(n_r + n)) gives it the variance that I_n has against a perfect reference.
 * Without linear data, or when the reference is not independent, pictures are taken as they are. Not thread-safe per object.
 */
#ifndef GGN_DATA_STIMULI_H
#define GGN_DATA_STIMULI_H

#include <stdint.h>

#include "base/err.h"
#include "sequence/block.h"

struct ggn_stimuli {
    const struct seq_block *block; /* borrows */
    int recorded;                  /* the first so many are recorded levels, the others simulated */
    int scale;                     /* whether the difference to the reference is scaled */
    double spp0;                   /* of the difference */
    int n;
    double *spp;                     /* owns; [n]; rising */
    float *base, *difference, *work; /* [3][P]; linear; `base` owns them, one allocation */
    uint8_t *converged;              /* owns; [P][3] */
};
int ggn_stimuli_init(struct ggn_stimuli *s, const struct seq_block *block, int reference_independent, struct base_err *err);
void ggn_stimuli_release(struct ggn_stimuli *s);
/* test: [P][3], the picture at spp[i]. */
int ggn_stimuli_make(struct ggn_stimuli *s, int i, uint8_t *test, struct base_err *err);

#endif
