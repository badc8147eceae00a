/*
 * A denoised pair: both halves of a picture's samples, each denoised by itself. What is kept of it is a blend of noisy and
 * denoised. The frame's picture (host/denoise.c) and the criterion `denoised` call the same stages, in this order, each of
 * which fills buffers of its own:
 *
 *     lull_denoised_open      the denoiser, for rectangles
 *     lull_denoised_begin     the size of the next one
 *     lull_denoised_put       half, albedo, normal: the caller reads the rectangle, pixel by pixel
 *     lull_denoised_run       denoised
 *     lull_denoised_again     denoised with clean auxiliaries, of the frame alone
 *     lull_denoised_cut       a part: pixels that are kept, without what lies around them
 *     lull_denoised_estimate  error: the caller tells how bright the part's pixels are shown
 *     lull_denoised_mix       the denoised halves take what they gain by those with clean auxiliaries
 *     lull_denoised_estimate  again, by the noisy halves
 *     lull_denoised_weigh     weight and apart; specks leave the denoised halves, the error is pooled
 *     lull_denoised_blend     each half of what is kept
 *
 * One thread per struct; different parts of one pair may be cut and judged at the same time. Nothing is allocated after
 * lull_denoised_open and lull_denoised_part_open, but by the first lull_denoised_again.
 */
#ifndef DENOISE_PAIR_H
#define DENOISE_PAIR_H

#include <stddef.h>

#include "denoise/blend.h"
#include "denoise/oidn.h"

/* Pixels [x0, x1) x [y0, y1) of a rectangle, which begins at 0, 0. */
struct lull_denoised_rect {
    int32_t x0, y0, x1, y1;
};

struct lull_denoised_pair { /* owns all memory; callers read and fill the buffers */
    struct lull_oidn *oidn;
    int32_t width, height;  /* of the rectangle */
    size_t pixels, room;    /* of it, and of the largest one */
    float *half[2];         /* [pixels][3]: A and B, linear */
    float *albedo, *normal; /* [pixels][3], NULL: not in the form */
    float *denoised[2];     /* [pixels][3]: F(A) and F(B) */
    float *other[2];        /* [pixels][3]: with clean auxiliaries; NULL until lull_denoised_again; other[0] owns both */
    void *memory;           /* of the others */
};

/* The pixels that are kept, row by row. */
struct lull_denoised_part {
    int32_t width, height;
    size_t pixels;
    float *half[2], *denoised[2]; /* [pixels][3] */
    struct lull_estimate error;   /* [pixels] each */
    float *weight;                /* [pixels]: share of the noisy picture, as lull_blend_weights says */
    float *apart;                 /* [pixels], likewise */
    float *scratch;               /* [pixels] */
    void *memory;                 /* owns what is not of a pair */
};

/* form: of a rectangle, which is the next one; no later one has more pixels. library: as for lull_oidn_open. All buffers are
 * 0. On failure *pair is zeroed. */
int lull_denoised_open(struct lull_denoised_pair *pair, const char *library, const struct lull_oidn_form *form,
                       struct base_err *err);
void lull_denoised_close(struct lull_denoised_pair *pair);

/* A rectangle of at most pair->room pixels; all four pictures that are read are 0. */
void lull_denoised_begin(struct lull_denoised_pair *pair, int32_t width, int32_t height);
/* Both halves of pixel `at` of the rectangle, from the mean of n samples and that of h of them; the mean twice where
 * these are none or all. Returns whether all are finite. */
int lull_denoised_put(struct lull_denoised_pair *pair, size_t at, const double mean[3], const double half[3], double n,
                      double h);
/* What lies outside `known` is its pixels mirrored on, in all four pictures. */
void lull_denoised_mirror(struct lull_denoised_pair *pair, struct lull_denoised_rect known);

/* As lull_oidn_run. */
int lull_denoised_run(struct lull_denoised_pair *pair, int (*cancelled)(void *data), void *data, struct base_err *err);

/* Denoises both halves once more with albedo and normal that are denoised first, into `other`, whose memory it takes;
 * without albedo it does nothing. As lull_oidn_run, and BASE_ENOMEM. */
int lull_denoised_again(struct lull_denoised_pair *pair, int (*cancelled)(void *data), void *data, struct base_err *err);

/* A part of at most `pixels`, which has pictures of its own, all 0; or of all pixels of the pair `whole`, whose pictures it
 * borrows until the pair is closed. On failure *part is zeroed. */
int lull_denoised_part_open(struct lull_denoised_part *part, size_t pixels, const struct lull_denoised_pair *whole,
                            struct base_err *err);
void lull_denoised_part_close(struct lull_denoised_part *part);

/* The part, which has pictures of its own, is this one of the pair's rectangle. */
void lull_denoised_cut(struct lull_denoised_part *part, const struct lull_denoised_pair *pair,
                       struct lull_denoised_rect rect);
/* Fills the error of the part's pixels [first, first + n). */
void lull_denoised_estimate(struct lull_denoised_part *part, size_t first, size_t n, const struct lull_estimate_in *in);
/* Of an error that all pixels have, by the pair's other pictures; the part is the whole rectangle. */
void lull_denoised_mix(struct lull_denoised_part *part, const struct lull_denoised_pair *pair);
/* Of an error that all pixels have, by the noisy halves. */
void lull_denoised_weigh(struct lull_denoised_part *part);
/* kept: two pictures [pixels][3] of the part: of each half, `weight` of the noisy and the rest of the denoised. */
void lull_denoised_blend(const struct lull_denoised_part *part, const float *weight, float *const kept[2]);

#endif
