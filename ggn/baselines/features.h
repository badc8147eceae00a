/*
 * Features of the published models before the network: numbers from the L channel (CIELAB) of one block. Pure functions,
 * thread-safe, without allocation. scratch: [GGN_FEATURE_SCRATCH][h][w], overwritten.
 */
#ifndef GGN_BASELINES_FEATURES_H
#define GGN_BASELINES_FEATURES_H

#include <stddef.h>
#include <stdint.h>

enum {
    GGN_SUB_BLOCK = 20,
    GGN_ATTRIBUTES = 26,
    GGN_MASK_GRID = 8,
    GGN_MASK_FEATURES = 2 * GGN_MASK_GRID * GGN_MASK_GRID,
    GGN_FEATURE_SCRATCH = 5
};

/* L in 0..100 of a display image, rgb [3][P] planar codes. */
void ggn_lightness(const uint8_t *rgb, size_t pixels, double *l);

/* How many values ggn_svd_entropy makes of a block: one per whole 20x20 sub-block. */
int ggn_svd_entropy_count(int w, int h);
/*
 * SVD-entropy (Buisine et al., Entropy 23(1):75, 2021): per sub-block, row by row, H = -sum v ln v / ln k over the singular
 * values number first .. last-1 in falling order (k = last - first), v = s^2 / sum s^2. L is floored first, as published. 0
 * <= first < last <= 20, k > 1; w, h >= 20. A sub-block whose singular values in the interval are all zero has H = 0. After
 * ggn_blas_open has returned 0. Not 0: they do not converge.
 */
int ggn_svd_entropy(const double *l, int w, int h, int first, int last, double *out);

/*
 * Mean and standard deviation of |L - filter(L)| for 13 filters (Constantin et al. 2015): box 3, 5; Gaussian 3x3 with sigma
 * 0.5, 1, 1.5, then 5x5 with the same; median 3, 5; Wiener 3, 5; Haar wavelet shrinkage. out: mean, deviation, mean, ...
 * w, h >= 3.
 */
void ggn_attributes(const double *l, int w, int h, double *scratch, double out[GGN_ATTRIBUTES]);

/*
 * Noise masks (Takouachet et al. 2017): |L - Gaussian(L)| of the image and of an approximate reference (here the image after
 * a 5x5 Wiener filter, since no reference is at hand), each reduced to the means of an 8x8 grid. w, h >= 8.
 */
void ggn_noise_mask(const double *l, int w, int h, double *scratch, double out[GGN_MASK_FEATURES]);

#endif
