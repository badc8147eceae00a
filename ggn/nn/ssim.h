/*
 * SSIM with its gradient (Wang et al. 2004): 11×11 Gaussian window, σ 1.5, zero padding, C1 = 1e-4, C2 = 9e-4, range 1,
 * averaged over all pixels of all planes.
 */
#ifndef GGN_NN_SSIM_H
#define GGN_NN_SSIM_H

#include <stdlib.h>

#include "base/threads.h"
#include "nn/real.h"

/* Memory for pictures up to h × w and up to `workers` threads; owned. One call at a time. */
struct ggn_ssim;
struct ggn_ssim *ggn_ssim_create(int h, int w, struct base_threads *threads, struct base_err *err);
static inline void ggn_ssim_destroy(struct ggn_ssim *ssim) { free(ssim); }

/* The mean of SSIM over n planes of h × w: x[i] and y[i] point at element (0,0), rows are `row` apart. When dx is not NULL,
 * dx[i] (same layout) = grad_scale · d mean / d x[i]. */
double ggn_ssim_mean(struct ggn_ssim *ssim, const real *const *x, const real *const *y, real *const *dx, int n, int row,
                     double grad_scale);

#endif
