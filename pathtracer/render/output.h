/*
 * What a render leaves behind, made from film and blocks: EXR, preview, stop map (picture or table), JSON report, page. Each
 * file is replaced as a whole or not at all.
 */
#ifndef PT_RENDER_OUTPUT_H
#define PT_RENDER_OUTPUT_H

#include "base/err.h"
#include "render/progress.h"
#include "render/render.h"

/* Which picture is kept. */
enum pt_picture { PT_PICTURE_NOISY, PT_PICTURE_BLEND, PT_PICTURE_DENOISED };

/* PT_FILM_* planes that it takes: what the denoiser reads, and of a blend the halves, by which its error is told. */
uint32_t pt_denoised_planes(enum pt_picture picture);

struct pt_denoised {    /* over the film's pixels, row by row from the top */
    float *rgb;         /* [n][3] what is kept; owns all */
    float *denoised;    /* [n][3] */
    float *weight;      /* [n] of the noisy picture in rgb */
    double weight_mean; /* over all pixels */
};

/* picture: not the noisy one. cancelled(data), which may be NULL, ends it. library: as for
 * lull_host_denoising. BASE_EINVAL: no denoiser, or one that fails; BASE_ENOMEM. On failure *out is zeroed. */
int pt_denoised_make(const struct pt_render *render, enum pt_picture picture, const char *library,
                     int (*cancelled)(void *data), void *data, struct pt_denoised *out, struct base_err *err);
void pt_denoised_release(struct pt_denoised *denoised);

struct pt_output_info {
    struct lull_host_report of; /* flags, scene, mask, kernel, scene_bytes, processor, command; the render says the rest */
    const struct lull_pair *params; /* of the criterion, as given */
    uint32_t param_count;
    pt_effects effects;                     /* what the scene calls for */
    int reproducible;                       /* leave times out of the EXR, so that equal renders are equal files */
    const struct pt_progress_now *progress; /* for the report; NULL: the render is over */
    const char *quote;                      /* JSON of the quote that the page compares with; NULL: none */
    const struct pt_denoised *denoised;     /* the picture; NULL: the noisy one */
    const double *noisy_error; /* [blocks] of the noisy picture, beside `error` of the denoised one; NULL: not known */
};

/* What the functions below are. */
typedef int pt_output_writer(const char *path, const struct pt_render *render, const struct pt_output_info *info,
                             struct base_err *err);

/* RGB, lull.spp.V, lull.p_noisy.V, lull.error.V, lull.reason.V and the config's AOVs, cropped as it says; of a denoised
 * picture noisy.RGB, denoised.RGB and lull.weight.V too, and lull.noisy_error.V where it is known. */
pt_output_writer pt_output_exr;
/* 0 when there is a file at `path` that is not such an EXR. */
int pt_output_is_ours(const char *path);
/* sRGB, 8 bits; without info the noisy picture. */
pt_output_writer pt_output_preview;
/* PNG or CSV by the name's ending. */
pt_output_writer pt_output_stop_map, pt_output_report;
/* The report with its pictures, as HTML. */
pt_output_writer pt_output_page;

/* What cannot be written to `path` (NULL: not asked for) is kept where temporary files go. On failure err says so; on
 * success it stays. */
void pt_output_or_keep(pt_output_writer *write, const char *path, const struct pt_render *render,
                       const struct pt_output_info *info, struct base_err *err);

/* pt_host_result of what writes a file: BASE_EIO if it could not. */
int pt_output_result(int32_t code, const struct lull_error *why, struct base_err *err);

#endif
