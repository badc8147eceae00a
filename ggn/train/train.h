/*
 * Training from recorded sequences to a model file.
 *
 * - Preset lull trains in two phases, because no gradient crosses between them: first the denoiser R on crops (1 − SSIM to
 *   the reference), then generator M and discriminator D (cross-entropy) on windows whose denoised images are computed once.
 * - Preset paper follows the published iteration.
 *
 * Both end with the best epoch on the validation scenes, a calibration and the choice of the stopping threshold there.
 *
 * Everything drawn is a function of (seed, step), sums have a fixed order: the same data, options and seed give the same
 * model bytes for any number of threads, also when a run is interrupted and resumed.
 */
#ifndef GGN_TRAIN_TRAIN_H
#define GGN_TRAIN_TRAIN_H

#include <signal.h>
#include <stdio.h>

#include "base/identity.h"
#include "data/series.h"
#include "model/networks.h"

enum { GGN_TRAIN_CROP = 96 };
enum { GGN_TRAIN_INTERRUPTED = 1 }; /* returned by ggn_train and its phases beside 0 and errors */

/* What a run is to do. */
struct ggn_train_plan {
    struct ggn_series_set_options data;
    const char *out;        /* model file; OUT.ckpt, OUT.csv and OUT.card.json lie beside it */
    const char *init;       /* model file to start from, or NULL */
    int resume;             /* continue from OUT.ckpt if it is there */
    struct ggn_hyper hyper; /* height, width, noise_map and scalars come from the data and what follows */
    int crop;               /* side of the denoiser's samples; 0: GGN_TRAIN_CROP, or the side of smaller blocks */
    int batch_r, batch;     /* samples per step */
    int steps_r, steps;     /* steps of the two phases; preset paper: of its one phase, 0 = epochs · windows / batch */
    int epochs;             /* preset paper */
    int epoch_steps;        /* steps between validations and checkpoints */
    double hours;           /* of processors; once spent, a validation of the last phase ends it. 0: no limit */
    int patience;           /* epochs without a lower calibrated validation loss before the end; 0 = never */
    double lr_r, lr;
    double difference; /* preset lull: see ggn_train_fold */
    int soft_labels;
    int flips;              /* see ggn_augment_options */
    double jitter;          /* octaves of exposure; see ggn_augment_options */
    double noise_map;       /* preset lull: share of windows that come with the noise map; 0: networks without it */
    int scalars;            /* with hyper.reach: the discriminator is given what was measured */
    int synthetic;          /* synthetic series per block */
    int extend;             /* continue recorded series beyond their last level, see ggn_series_set_extend */
    int validation_windows; /* most windows per validation */
    double early_rate;      /* share of validation blocks that may be stopped early (ggn_stopping.early_rate) */
    uint32_t seed;
    int threads;                              /* 0: all that the process may use */
    struct base_identity identity;            /* owns; options that decide the result, for resuming; empty: none */
    FILE *progress;                           /* lines for people, or NULL */
    const volatile sig_atomic_t *interrupted; /* checked between steps, or NULL */
};

struct ggn_train_plan ggn_train_plan_default(enum ggn_preset preset);

/* Runs the plan. GGN_TRAIN_INTERRUPTED: the checkpoint of the last finished epoch is there. */
int ggn_train(const struct ggn_train_plan *plan, struct base_err *err);

#endif
