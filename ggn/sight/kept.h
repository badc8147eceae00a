/*
 * How visible the error is of a picture that is kept of two denoised halves: what the criterion `denoised` decides by. Both
 * estimates are of what the eye is left with after the observer's blur, over what texture hides (sight/visibility.h):
 *
 * - halves: how far the kept halves are apart. Bias, which they share, is not in it.
 * - crossed: how far each is from the other, noisy half (denoise/blend.h's formula, what is kept in the place of F). Bias
 *   is in it. The observer asks for the mean of sixth powers over each of its patches; the largest of three counts:
 *   - the mean square with half a standard error more, so that luck stops little, and never below that of the halves; errors
 *     as uneven as the halves' difference, and at least Gaussian (15 cubes of the mean square);
 *   - over tiles of 25 px, with two standard errors less: a small place where the denoiser fails, beyond doubt;
 *   - over the edges of each octave of strength, with one less: there denoisers err most.
 *   An estimate below zero counts as if above: both halves are denoised with the same albedo, whose noise, where it has any,
 *   the other half shares.
 *
 * Pure functions on memory of the caller, thread-safe.
 */
#ifndef GGN_OBSERVER_KEPT_H
#define GGN_OBSERVER_KEPT_H

#include <stddef.h>

#include "sight/viewing.h"

struct ggn_kept { /* of a block, as a display shows it; [height][width] each */
    int width, height;
    const float *lightness[2]; /* L* of both denoised halves */
    const float *slope;        /* of L* by luminance, at the denoised picture */
    const float *noisy[2];     /* luminance of both noisy halves */
    const float *crossed[2];   /* of what is kept of each half; no pixel's weight from its own samples, by which the error
                                  would look a third too small (denoise/blend.h) */
    const float *apart;        /* L* by which the kept halves differ, at the strength of their mean */
};

struct ggn_kept_errors { /* visible noise r, or bias as strong */
    double halves, crossed;
};

/* Doubles of scratch memory for blocks of this size. */
size_t ggn_kept_scratch(int width, int height);
/* viewing: of a moving picture, in which noise is new in each frame and bias stands still, or of one that is seen from
 * another distance; or NULL. */
struct ggn_kept_errors ggn_kept_judge(const struct ggn_kept *kept, const struct ggn_viewing *viewing, double *scratch);

#endif
