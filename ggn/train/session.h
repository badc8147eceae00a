/*
 * A training run in progress: data, networks, the trainer of the present phase, the best epoch. Private to ggn/train.
 */
#ifndef GGN_TRAIN_SESSION_H
#define GGN_TRAIN_SESSION_H

#include "data/windows.h"
#include "model/model.h"
#include "model/trainer.h"
#include "train/log.h"
#include "train/train.h"

enum { GGN_PHASE_DENOISER, GGN_PHASE_CLASSIFIER };

/* Numbers of the run that a checkpoint keeps. */
struct ggn_progress {
    int phase;
    uint64_t step;   /* of the phase */
    int stale;       /* epochs since the best one */
    int divergences; /* each one halves the learning rates and changes the draws */
    double best_loss;
    uint64_t best_step;
    double seconds[2], processor_s[2]; /* spent in the phases */
};

struct ggn_session {
    const struct ggn_train_plan *plan;
    struct base_threads *threads;
    struct ggn_series_set set;
    uint32_t data_crc; /* of the set */
    struct ggn_windows train, validation;
    int crop;                    /* side of the denoiser's samples */
    struct ggn_hyper hyper;      /* of the model */
    struct ggn_model *init;      /* where to start from, or NULL */
    struct ggn_graph r_graph;    /* the denoiser at full size */
    struct ggn_weights *r;       /* its weights once phase 0 is over (preset paper: a copy, renewed each epoch) */
    struct ggn_trainer *trainer; /* of the present phase */
    float *best[GGN_NETS];       /* the best epoch's networks that the phase trains, as ggn_weights_copy takes them */
    struct ggn_progress progress;
    struct ggn_log log;
    float *buffer;        /* pixels of a batch */
    const float **planes; /* pointers into it */
    double scale;         /* with plan->reach: of the logistic, per octave of noise */
};

/* Loads the data and checks the plan against it. `session` starts as {.plan = plan}; release it also after a failure. */
int ggn_session_init(struct ggn_session *session, struct base_err *err);
void ggn_session_release(struct ggn_session *session);
/* Loads plan->init: a model of the same networks. */
int ggn_session_load_init(struct ggn_session *session, struct base_err *err);

/* Makes the trainer of a phase with the networks GGN_TRAIN_* for blocks of height × width, in the place of the former. */
int ggn_session_begin(struct ggn_session *session, int parts, int batch, int height, int width, struct base_err *err);

/* To and from `best`. */
void ggn_session_keep_best(struct ggn_session *session);
void ggn_session_load_best(struct ggn_session *session);

/* Cosine from lr down to a fiftieth, after a short warm-up; divergences halve it. */
double ggn_session_lr(const struct ggn_session *session, double lr, uint64_t step, uint64_t steps);
/* With plan->reach: log2 of the law's error at level k. */
double ggn_session_law(const struct ggn_session *session, const struct ggn_level_series *series, int k);
/* Seed of the draws. */
uint32_t ggn_session_seed(const struct ggn_session *session);
/* With the weights of the best epoch: calibration and stopping policy on the validation scenes, model file and card. */
int ggn_session_finish(struct ggn_session *session, struct base_err *err);

#endif
