/*
 * The view of a block of a picture that will be denoised: both halves of its samples and what the denoiser makes of them
 * (plugin/denoised/look.h), of which two estimates say how visible the error is of the picture that will be kept
 * (sight/kept.h). This translates pictures into what a display shows.
 *
 * The picture that is kept is the mean of two, P(A) and P(B), each of one half: a blend of the noisy half and the denoised
 * one without its specks (denoise/blend.h), or the denoised one alone. What is crossed with the other half is a blend, too,
 * but by the weights of the neighbourhood (lull_blend_weights_cross_validated).
 *
 * One struct gd_block_view per worker; nothing is allocated after gd_block_view_create.
 */
#ifndef GGN_PLUGIN_DENOISED_BLOCK_VIEW_H
#define GGN_PLUGIN_DENOISED_BLOCK_VIEW_H

#include "sight/kept.h"
#include "plugin/denoised/look.h"

struct gd_block_view {
    struct lull_denoised_part part; /* the block, of P pixels */
    float *rgb;                     /* [3][P]: one picture as a display shows it */
    float *noisy_light[2];          /* [P] each: luminance that is shown of the noisy halves, */
    float *denoised_light[2];       /* of the denoised ones, */
    float *crossed_light[2];        /* of the blends by the neighbourhood's weights, */
    float *kept_light[2];           /* and of what is kept */
    float *lightness[2];            /* [P]: L* of the denoised halves */
    float *apart_lightness[2];      /* [P]: L* of the mean and of the darker kept half, each where it belongs */
    float *slope, *apart;           /* [P]: struct ggn_kept */
    float *weight;                  /* [P]: of the neighbourhood */
    float *around;                  /* [2][P]: scratch of it */
    float *crossed[2];              /* [P][3]: those blends */
    float *kept[2];                 /* [P][3] */
    double *judging;                /* scratch of sight/kept.h */
    void *memory;                   /* owns all of the above but the part */
};

/* For blocks of this form. */
int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, struct base_err *err);
void gd_block_view_release(struct gd_block_view *seen);

/* Estimates the error of a block that the look has denoised. blend: the picture kept is the blend. viewing: as for
 * ggn_kept_judge. */
struct ggn_kept_errors gd_block_view_errors(struct gd_block_view *seen, const struct gd_look *look,
                                            const struct lull_kit *kit, const struct lull_block *block, int blend,
                                            const struct ggn_viewing *viewing);

#endif
