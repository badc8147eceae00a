/*
 * The view of a block of a picture that will be denoised: both halves of its samples are denoised, with what lies around,
 * and two estimates say how visible the error is of the picture that will be kept (denoise/estimate.h,
 * model/visibility.h).
 *
 * The picture that is kept lies between the mean M of all samples and its denoised form F(M), M with the weight alpha of
 * denoise/blend.h, or F(M) alone.
 *
 * - halves: the difference of the two denoised halves. Bias, which they share, is not in it.
 * - crossed: the difference of each denoised half from the other, noisy one. Bias is in it. It is noise itself, so it is
 *   averaged twice, and the larger result counts:
 *   - over each patch of the observer, with one standard error more, so that luck stops nothing;
 *   - over tiles of 25 px, with two standard errors less, so that a small place where the denoiser fails counts where it is
 *     beyond doubt.
 *   Errors are taken as Gaussian inside: a sixth moment is 15 cubes of the mean square.
 *
 * One struct gd_block_view per worker; nothing is allocated after gd_block_view_create.
 */
#ifndef GGN_PLUGIN_DENOISED_BLOCK_VIEW_H
#define GGN_PLUGIN_DENOISED_BLOCK_VIEW_H

#include <lull/criterion_kit.h>

#include "denoise/oidn.h"

/* Pixels around a block that the denoiser is shown, and the most that lie there because the corner is on its grid. */
enum { GD_HALO = 32, GD_REACH = GD_HALO + LULL_OIDN_GRID - 1 };

struct gd_form {               /* of a frame */
    struct lull_rect area;     /* around all blocks */
    int32_t width, height;     /* of the largest blocks */
    struct lull_oidn_form box; /* what is denoised for a block, of any size */
};

struct gd_errors { /* visible noise r */
    double halves, crossed;
};

struct gd_block_view {
    struct lull_oidn *oidn;
    float *box[6];       /* [box][3]: half A, half B, albedo, normal, denoised A, denoised B */
    float *rgb;          /* [3][P], displayed light */
    float *light[4];     /* [P]: displayed luminance of A, B and both denoised */
    float *lightness[4]; /* [P]: L* of the same */
    float *maps[3], *crossed, *agreed, *scratch, *alpha; /* [P] */
    double *texture;                                     /* [patches] */
    double *rows;                                        /* scratch of model/visibility.h */
    void *memory;                                        /* owns all of the above but oidn */
    struct base_err err;                                 /* of the last call that failed */
};

/* frame: checked. quality: of struct lull_oidn_form. */
struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality);

/* library: as for lull_oidn_open. */
int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, const char *library, struct base_err *err);
void gd_block_view_release(struct gd_block_view *seen);

/* Reads a block of 0 < half_spp < spp and its surroundings. Returns whether the halves differ anywhere in the block. */
int gd_block_view_read(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                       const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally);
/* Denoises what was read and estimates its error. blend: the picture kept is the blend. 0, or a negative code and
 * seen->err. */
int gd_block_view_errors(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                         const struct lull_block *block, int blend, struct gd_errors *errors);
/* Whether the block that was read shows more than one colour. */
int gd_block_view_structure(const struct gd_block_view *seen, const struct gd_form *form, const struct lull_block *block);

#endif
