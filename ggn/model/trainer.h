/*
 * Training: the three networks with their optimisers, and the steps that a training loop is made of.
 *
 * A trainer owns weights, Adam moments, gradients and executors; everything a checkpoint needs is reachable through
 * ggn_trainer_state, so that resuming continues bit-exactly. Results do not depend on the number of threads. One call at a
 * time. Parts that a phase does not use (the denoiser when training on cached denoised windows) can be left out.
 *
 * Every step checks its losses and gradients: when one is not finite or has exploded, nothing of the step remains, the
 * trainer returns to the last good state (ggn_trainer_keep) and the step returns GGN_EDIVERGED with the tensor's name.
 */
#ifndef GGN_MODEL_TRAINER_H
#define GGN_MODEL_TRAINER_H

#include "model/networks.h"
#include "nn/exec.h"
#include "nn/ssim.h"

enum { GGN_EDIVERGED = -10, GGN_BATCH_MAX = 1024 };

enum { GGN_TRAIN_R = 1, GGN_TRAIN_MD = 2, GGN_TRAIN_ALL = 3 };

struct ggn_train_options {
    int parts;           /* GGN_TRAIN_*: the networks that are trained and need memory */
    int batch;           /* largest batch */
    double lr[GGN_NETS]; /* may be changed between steps (schedules) */
    double beta1, beta2, eps;
    double clip;    /* largest L2 norm of a network's gradient; 0 = no clipping */
    double explode; /* a loss or gradient norm above it counts as divergence */
    int dropout;
    double scale; /* with hyper.reach: logit = scale · octaves */
    enum ggn_init init[GGN_NETS];
    uint32_t seed;
};

/* Published: lr 2e-4, betas (0.5, 0.999), dropout. LULL adds He initialisation and clipping at 1. */
struct ggn_train_options ggn_train_options_default(enum ggn_preset preset);

/* A batch. Pictures are planes of height × width elements without gaps, values 0..1. */
struct ggn_batch {
    int count;
    const real *const *noisy;     /* [count][3S] windows, noisiest image first (M's input order: image, channel) */
    const real *const *denoised;  /* [count][3S] for ggn_trainer_classifier_step */
    const real *const *reference; /* [count][3] for ggn_trainer_paper_step */
    const real *const *noise_map; /* [count] noise maps, GGN_NOISE_MAP_GAIN · codes, NULL: none; with hyper.noise_map */
    const real *const *scalars;   /* [count][GGN_SCALARS], with hyper.scalars */
    const double *law;            /* [count] with hyper.reach: log2 of the law's error */
    const double *label;          /* [count] 1 = still noisy, 0 = not, between = uncertain */
};

struct ggn_trainer {
    struct ggn_hyper hyper;
    struct ggn_train_options options;
    struct base_threads *threads; /* borrows */
    struct ggn_graph graph[GGN_NETS];
    struct ggn_weights *weights[GGN_NETS];     /* owns */
    real *grad[GGN_NETS];                      /* [n_params] of the last step; owns the three below, too */
    real *adam_m[GGN_NETS], *adam_v[GGN_NETS]; /* [n_params] */
    uint64_t adam_t[GGN_NETS];                 /* updates made */
    uint64_t steps;                            /* steps made; seeds dropout */
    struct ggn_exec *r, *m, *m2, *d;           /* m2: second generator pass of the published order */
    struct ggn_ssim *ssim;
    real *good[GGN_NETS]; /* the last good state, as ggn_trainer_state lists it */
    uint64_t good_t[GGN_NETS], good_steps;
};

/* NULL on failure. Weights are initialised and packed. */
struct ggn_trainer *ggn_trainer_create(const struct ggn_hyper *hyper, const struct ggn_train_options *options,
                                       struct base_threads *threads, struct base_err *err);
void ggn_trainer_destroy(struct ggn_trainer *trainer);

/* Remembers the present state as the one to return to after a divergence (create does so too). */
void ggn_trainer_keep(struct ggn_trainer *trainer);

/* The arrays that a checkpoint of network `net` holds beside adam_t and steps, i = 0..4: params, mean, var, m, v. NULL past
 * the end. After writing into them call ggn_weights_pack on weights[net]. */
real *ggn_trainer_state(struct ggn_trainer *trainer, int net, int i, size_t *count);

/* One Adam step of R on `count` images (x and reference: [count][3] planes). *loss = mean of 1 − SSIM before it. The
 * denoised images stay in trainer->r (value n_values − 1) until the next step. */
int ggn_trainer_denoiser_step(struct ggn_trainer *trainer, const real *const *x, const real *const *reference, int count,
                              double *loss, struct base_err *err);

/* loss[count]: 1 − SSIM of what R makes of the images in evaluation mode. Pack the weights before. */
void ggn_trainer_denoiser_losses(struct ggn_trainer *trainer, const real *const *x, const real *const *reference, int count,
                                 double *loss);

/* One Adam step of M and D on given denoised windows, mended form: both windows pass M in one batch (shared statistics), one
 * backward pass, all of M is trained. *bce = mean before it; logits (may be NULL) [count]. */
int ggn_trainer_classifier_step(struct ggn_trainer *trainer, const struct ggn_batch *batch, double *bce, double *logits,
                                struct base_err *err);

/* D's answers [count] to the batch in evaluation mode: logits, or with hyper.reach octaves, law + the correction. Pack the
 * weights before. */
void ggn_trainer_answers(struct ggn_trainer *trainer, const struct ggn_batch *batch, double *answers);

/* One published iteration: six steps of R, one of D, one of M on the sum of two gradients without its last convolution. */
struct ggn_paper_record {
    double denoiser_loss[16];                 /* [S] */
    double denoiser_grad_l2;                  /* of the first image */
    double logit_before[64], logit_after[64]; /* [count], counts above 64 are not recorded */
    double bce_before, bce_after;
    double d_grad_l2;
    double m_grad_l2_accumulated; /* last convolution excluded */
};
int ggn_trainer_paper_step(struct ggn_trainer *trainer, const struct ggn_batch *batch, struct ggn_paper_record *record,
                           struct base_err *err);

#endif
