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
#include "nn/loss.h"

enum { GGN_EDIVERGED = -10 };

enum { GGN_TRAIN_R = 1, GGN_TRAIN_MD = 2, GGN_TRAIN_ALL = 3 };

struct ggn_train_options {
    int parts;           /* GGN_TRAIN_*: the networks that are trained and need memory */
    int batch;           /* largest batch */
    double lr[GGN_NETS]; /* may be changed between steps (schedules) */
    double beta1, beta2, eps;
    double clip;    /* largest L2 norm of a network's gradient; 0 = no clipping */
    double explode; /* a loss or gradient norm above it counts as divergence */
    int keep_every; /* steps between automatic calls of ggn_trainer_keep; 0 = never */
    int dropout;
    int bf16; /* weights also packed for GGN_EXEC_BF16 */
    enum ggn_init init[GGN_NETS];
    uint32_t seed;
};

/* Published: lr 2e-4, betas (0.5, 0.999), dropout. LULL adds He initialisation and clipping at 1. */
struct ggn_train_options ggn_train_options_default(enum ggn_preset preset);

#define REAL float
#define TYPED(name) GGN_TYPED(name, f32)
#include "model/trainer_decl.inc"
#undef REAL
#undef TYPED

#define REAL double
#define TYPED(name) GGN_TYPED(name, f64)
#include "model/trainer_decl.inc"
#undef REAL
#undef TYPED

#endif
