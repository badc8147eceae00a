/*
 * The view of a block of a picture that will be denoised: both halves of its samples are denoised, with what lies around
 * (denoise/pair.h), and two estimates say how visible the error is of the picture that will be kept (observer/kept.h). This
 * translates: the ABI's view into the pair, the pair into what a display shows.
 *
 * The picture that is kept is the mean of two, P(A) and P(B), each of one half: a blend of the noisy half and the denoised
 * one without its specks (denoise/blend.h), or the denoised one alone. What is crossed with the other half is a blend, too,
 * but by the weights of the neighbourhood (lull_blend_weights_blind).
 *
 * One struct gd_block_view per worker; nothing is allocated after gd_block_view_create.
 */
#ifndef GGN_PLUGIN_DENOISED_BLOCK_VIEW_H
#define GGN_PLUGIN_DENOISED_BLOCK_VIEW_H

#include <lull/criterion_kit.h>

#include "denoise/pair.h"
#include "observer/kept.h"

/* Pixels around a block that the denoiser is shown, and the most that lie there because the corner is on its grid. */
enum { GD_HALO = 32, GD_REACH = GD_HALO + LULL_OIDN_GRID - 1 };

struct gd_form {               /* of a frame */
    struct lull_rect area;     /* around all blocks */
    int32_t width, height;     /* of the largest blocks */
    struct lull_oidn_form box; /* what is denoised for a block, of any size */
};

struct gd_block_view {
    struct lull_denoised_pair pair; /* of the box; its part is the block, of P pixels */
    struct lull_rect box;           /* of the block that was read last */
    float *rgb;                     /* [3][P]: one picture as a display shows it */
    float *noisy_light[2];          /* [P] each: luminance that is shown of the noisy halves, */
    float *denoised_light[2];       /* of the denoised ones, */
    float *crossed_light[2];        /* of the blends by the neighbourhood's weights, */
    float *kept_light[2];           /* and of what is kept */
    float *lightness[2];            /* [P]: L* of the denoised halves */
    float *apart_lightness[2];      /* [P]: L* of the mean and of the darker kept half, each where it belongs */
    float *slope, *apart;           /* [P]: struct ggn_kept */
    float *weight;                  /* [P]: of the neighbourhood */
    float *around;                  /* [3][P]: scratch of it */
    float *crossed[2];              /* [P][3]: those blends */
    float *kept[2];                 /* [P][3] */
    double *judging;                /* scratch of observer/kept.h */
    void *memory;                   /* owns all of the above but the pair */
    struct base_err err;            /* of the last call that failed */
};

/* frame: checked. quality: of struct lull_oidn_form. */
struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality);

/* library: as for lull_oidn_open. */
int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, const char *library, struct base_err *err);
void gd_block_view_release(struct gd_block_view *seen);

/* Reads a block of 0 < half_spp < spp and its surroundings. Returns whether the halves differ anywhere in the block. */
int gd_block_view_read(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                       const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally);
/* Whether the block that was read shows more than one colour. */
int gd_block_view_structure(struct gd_block_view *seen, const struct lull_block *block);
/* Denoises what was read and estimates its error. blend: the picture kept is the blend. temporal: as for ggn_kept_judge. 0,
 * or a negative code and seen->err. */
int gd_block_view_errors(struct gd_block_view *seen, const struct lull_kit *kit, const struct lull_block *block, int blend,
                         const struct ggn_temporal *temporal, struct ggn_kept_errors *errors);

#endif
