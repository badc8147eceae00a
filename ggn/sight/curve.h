/*
 * How visible the noise of a recorded block is at any number of samples.
 *
 * - From two halves: M and D of the block's full level, recorded at n0 spp, give two halves at n spp as M + sqrt(n0/n) D and
 *   the same with the other sign, for n > n0 up to SEQ_SIMULATED_CAP. Recorded levels below n0 are measured by their own
 *   halves. It errs where rare bright paths make the noise far from Gaussian (ggn/sight/README.md).
 * - From recorded levels: the picture I at n spp against a reference R of n_r independent samples. I - R has the variance
 *   s^2 (1/n + 1/n_r), so it is scaled by sqrt(n_r / (n_r + n)); texture is what the last level and R share. Where the block
 *   has halves too they go on beyond the last level.
 * - From recorded levels of which R is the last one, so that it has their samples among its own: I - R has the variance
 *   s^2 (1/n - 1/n_r) and stands for 1 / (1/n - 1/n_r) samples, as in people's studies (observer.h). Of the levels those
 *   count that stand for at most 2 n_r samples: the curve ends there, and what is seen at its end is censored.
 */
#ifndef GGN_OBSERVER_CURVE_H
#define GGN_OBSERVER_CURVE_H

#include "base/err.h"
#include "sequence/block.h"

enum ggn_curve_source { GGN_FROM_HALVES, GGN_FROM_LEVELS };
extern const char *const ggn_curve_sources[]; /* "halves", "levels", NULL */

struct ggn_curve {
    int n, recorded;       /* levels; the first so many are recorded ones */
    double *spp, *visible; /* own; [n]; spp rising; ggn_visible_noise at each */
};

/* BASE_EINVAL: GGN_FROM_HALVES without a full level, GGN_FROM_LEVELS without a reference or a level below it. */
int ggn_curve_make(const struct seq_block *block, enum ggn_curve_source source, int reference_independent,
                   struct ggn_curve *curve, struct base_err *err);
void ggn_curve_release(struct ggn_curve *curve);

/* Visible noise of one recorded level as the criterion `observer` sees it in the renderer: from the level's own two halves
 * (where only the luminance of their difference was recorded, that, as grey), or, with `earlier`, as in a host without
 * halves: from the level and one of fewer samples, both running means of the same samples (plugin/means.h says how).
 * BASE_EINVAL: not recorded. */
int ggn_curve_level(const struct seq_block *block, const struct seq_record *earlier, const struct seq_record *level,
                    double *visible, struct base_err *err);

/* Smallest spp from which the noise stays at or below `limit`, interpolated between levels in log-log. censored: still above
 * at the last level, which is then returned. A curve that starts below gives its first level. */
double ggn_curve_threshold(const struct ggn_curve *curve, double limit, int *censored);
/* Visible noise at spp, interpolated in log-log; before the first level it is that level's, as 1/sqrt(spp) rises; beyond the
 * last that level's. */
double ggn_curve_at(const struct ggn_curve *curve, double spp);

#endif
