/*
 * The view of a block of a picture that will be denoised: both halves of its samples are denoised, with what lies around,
 * and two estimates say how visible the error is of the picture that will be kept (denoise/estimate.h,
 * model/visibility.h).
 *
 * The picture that is kept is the mean of two, P(A) and P(B), each of one half: alpha of the noisy half, the rest of the
 * denoised one without its specks (denoise/blend.h); alpha is 0 and specks stay where the denoised picture alone is kept.
 * Both estimates are of what the eye is left with after the observer's blur, over what texture hides:
 *
 * - halves: how far P(A) and P(B) are apart. Bias, which they share, is not in it.
 * - crossed: how far each is from the other, noisy half (estimate.h's formula, P in the place of F). Bias is in it. alpha is
 *   that of the neighbourhood alone here (lull_blend_weights_blind): chosen by the pixel's own samples it would leave a
 *   third of the mean square unseen. The observer asks for the mean of sixth powers over each of its patches; the largest of
 *   three estimates counts:
 *   - the mean square with half a standard error more, so that luck stops little, and never below that of the halves; errors
 *     as uneven as the halves' difference, and at least Gaussian (15 cubes of the mean square);
 *   - over tiles of 25 px, with two standard errors less: a small place where the denoiser fails, beyond doubt;
 *   - over the edges of each octave of strength, with one less: there denoisers err most.
 *   An estimate below zero counts as if above: both halves are denoised with the same albedo, whose noise, where it has any,
 *   the other half shares.
 *
 * One struct gd_block_view per worker; nothing is allocated after gd_block_view_create.
 */
#ifndef GGN_PLUGIN_DENOISED_BLOCK_VIEW_H
#define GGN_PLUGIN_DENOISED_BLOCK_VIEW_H

#include <lull/criterion_kit.h>

#include "denoise/oidn.h"
#include "observer/temporal.h"

/* Pixels around a block that the denoiser is shown, and the most that lie there because the corner is on its grid. */
enum { GD_HALO = 32, GD_REACH = GD_HALO + LULL_OIDN_GRID - 1 };

struct gd_form {               /* of a frame */
    struct lull_rect area;     /* around all blocks */
    int32_t width, height;     /* of the largest blocks */
    struct lull_oidn_form box; /* what is denoised for a block, of any size */
};

struct gd_errors { /* visible noise r, or bias as strong */
    double halves, crossed;
};

struct gd_block_view {
    struct lull_oidn *oidn;
    float *box[6];       /* [box][3]: half A, half B, albedo, normal, denoised A, denoised B */
    float *rgb;          /* [3][P], displayed light */
    float *light[4];     /* [P]: displayed luminance of A, B and both denoised, later both kept */
    float *lightness[2]; /* [P]: L* of a pair */
    float *edges;        /* [P]: L* of the denoised picture */
    float *slope, *crossed, *blurred, *apart, *scratch, *alpha, *blind; /* [P] */
    double *texture;                                                    /* [patches] */
    double *rows;                                                       /* scratch of model/visibility.h */
    void *memory;                                                       /* owns all of the above but oidn */
    struct base_err err;                                                /* of the last call that failed */
};

/* frame: checked. quality: of struct lull_oidn_form. */
struct gd_form gd_form_of(const struct lull_frame *frame, enum lull_oidn_quality quality);

/* library: as for lull_oidn_open. */
int gd_block_view_create(struct gd_block_view *seen, const struct gd_form *form, const char *library, struct base_err *err);
void gd_block_view_release(struct gd_block_view *seen);

/* Reads a block of 0 < half_spp < spp and its surroundings. Returns whether the halves differ anywhere in the block. */
int gd_block_view_read(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                       const struct lull_view *view, const struct lull_block *block, struct lull_kit_tally *tally);
/* Denoises what was read and estimates its error. blend: the picture kept is the blend. temporal: of a moving picture, in
 * which noise is new in each frame and bias is taken to stand still; or NULL. 0, or a negative code and seen->err. */
int gd_block_view_errors(struct gd_block_view *seen, const struct gd_form *form, const struct lull_kit *kit,
                         const struct lull_block *block, int blend, const struct ggn_temporal *temporal,
                         struct gd_errors *errors);
/* Whether the block that was read shows more than one colour. */
int gd_block_view_structure(const struct gd_block_view *seen, const struct gd_form *form, const struct lull_block *block);

#endif
