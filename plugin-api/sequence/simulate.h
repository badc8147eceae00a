/*
 * A recorded block at n samples that were not recorded: what follows from the two halves of one level.
 *
 * M is the mean of N samples, D = (A - B)/2 the difference of the means of its halves (FORMAT.md): noise of the variance of
 * M where the halves are equal. M + sqrt(N/n) D has the noise of n samples; M - sqrt(N/n) D is a second such picture. All
 * values are linear light. Thread-safe; the scales are pure functions of sample counts > 0.
 */
#ifndef SEQUENCE_SIMULATE_H
#define SEQUENCE_SIMULATE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "sequence/block.h"

enum {
    SEQ_SIMULATED_CAP = 20000, /* spp; nothing is simulated beyond, and labels made from simulated levels end here */
    SEQ_STUDY_CAP = 10000      /* spp; the most that people are shown, where their thresholds are censored */
};

/* Takes noise of spp0 samples to that of spp: sqrt(spp0 / spp). */
static inline double seq_noise_scale(double spp0, double spp) { return sqrt(spp0 / spp); }

/* Takes D of halves of half_spp and spp - half_spp samples to the variance of the mean of all spp: s^2/4 (1/h + 1/(n - h))
 * is larger than s^2/n where the halves are unequal, as those of the first samples are. 1 for equal halves; 0: one half is
 * empty, and D no difference. */
static inline double seq_half_scale(double spp, double half_spp) { return 2 * sqrt(half_spp * (spp - half_spp)) / spp; }

/* Takes the difference of two means of the same samples, of the first `earlier` and of all `spp` > earlier, to the variance
 * of the mean of all: it has s^2 (1/n1 - 1/n2), and is uncorrelated with the second mean. */
static inline double seq_means_scale(double earlier, double spp) { return sqrt(earlier / (spp - earlier)); }

/* Takes the difference of a mean of spp samples to one of reference_spp others, of variance s^2 (1/n + 1/n_r), to that of
 * the mean of spp alone: against a perfect reference. */
static inline double seq_reference_scale(double reference_spp, double spp)
{
    return sqrt(reference_spp / (reference_spp + spp));
}

/* out = mean + scale * difference, `values` of each; out may be one of them. */
void seq_simulate(const float *mean, const float *difference, size_t values, double scale, float *out);

/* M and D of one record, [3][P] each; where only the luminance of D was recorded, that, as grey. Errors: as those of
 * seq_mean and seq_half. */
int seq_halves(const struct seq_block *b, const struct seq_record *r, float *mean, float *difference, struct base_err *err);

/* Sample counts from `first` to `last`, each `step` times the one before (geometric, step > 1) or `step` more: rounded to
 * whole samples, each once, `last` always. 1 <= first <= last. Returns how many; room + 1: spp [room] is too short. */
int seq_levels(double first, double last, double step, int geometric, uint32_t *spp, int room);

#endif
