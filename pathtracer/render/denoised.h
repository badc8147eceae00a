/*
 * The denoised picture of a render (lull_host_denoise with the film as the view), and what the noisy one would have needed.
 */
#ifndef PT_RENDER_DENOISED_H
#define PT_RENDER_DENOISED_H

#include "base/err.h"
#include "render/render.h"

/* Which picture is kept. */
enum pt_picture { PT_PICTURE_NOISY, PT_PICTURE_BLEND, PT_PICTURE_DENOISED };

/* PT_FILM_* planes that it takes: what the denoiser reads, and of a blend the halves, by which its error is told. */
uint32_t pt_denoised_planes(enum pt_picture picture);

struct pt_denoised {    /* over the film's pixels, row by row from the top; owned */
    float *rgb;         /* [n][3] what is kept */
    float *denoised;    /* [n][3] */
    float *weight;      /* [n] of the noisy picture in rgb */
    double weight_mean; /* over all pixels */
};

/* picture: not the noisy one. cancelled(NULL), which may be NULL, ends it. library: as for
 * lull_host_denoising. BASE_EINVAL: no denoiser, or one that fails; BASE_ENOMEM. On failure *out is zeroed. */
int pt_denoised_make(const struct pt_render *render, enum pt_picture picture, const char *library,
                     int (*cancelled)(void *data), struct pt_denoised *out, struct base_err *err);
void pt_denoised_release(struct pt_denoised *denoised);

#endif
