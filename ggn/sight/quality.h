/*
 * Two figures of a picture against a reference that the literature asks for beside FLIP (sight/flip.h). Thread-safe.
 */
#ifndef GGN_SIGHT_QUALITY_H
#define GGN_SIGHT_QUALITY_H

#include "base/err.h"
#include "picture/image.h"

/* SSIM (nn/ssim.h) of the sRGB codes, mean over pixels and channels: 1 for equal pictures. Both have codes, three channels
 * and one size. BASE_ENOMEM. */
int ggn_quality_ssim(const struct pic_image *reference, const struct pic_image *image, double *ssim, struct base_err *err);

/* Relative mean square error of linear light, mean over pixels and channels of (x - r)^2 / (r^2 + 0.01), as papers on
 * denoising measure it since Rousselle et al. 2012. Light is what the file holds, else that of its codes; negative and not
 * finite values count as 0. */
double ggn_quality_relmse(const struct pic_image *reference, const struct pic_image *image);

#endif
