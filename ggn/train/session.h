/*
 * A training run in progress; private to ggn/train.
 */
#ifndef GGN_TRAIN_SESSION_H
#define GGN_TRAIN_SESSION_H

#include "model/policy.h"
#include "model/trainer.h"
#include "train/calibrate.h"
#include "train/log.h"
#include "train/train.h"
#include "data/windows.h"

enum { GGN_PHASE_DENOISER, GGN_PHASE_JUDGE, GGN_PHASE_DONE };

/* Numbers of the run that a checkpoint keeps. */
struct ggn_progress {
    int phase;
    uint64_t step;        /* of the phase */
    int stale;            /* epochs since the best one */
    int divergences;      /* each one halves the learning rates and changes the draws */
    double best_loss;
    uint64_t best_step;
    double seconds[2];    /* spent in the phases */
};

struct ggn_session {
    const struct ggn_train_plan *plan;
    struct base_threads *threads;
    struct ggn_chains set;
    struct ggn_windows train, validation;
    struct ggn_hyper hyper;       /* of the model */
    struct ggn_graph r_graph;     /* the denoiser at full size */
    struct ggn_weights *r;    /* its weights once phase 0 is over (preset paper: a copy, renewed each epoch) */
    struct ggn_trainer *trainer; /* of the present phase */
    float *best[2];               /* [GGN_NET_M − 1], [GGN_NET_D − 1]: params, mean, var of the best epoch, one after the other */
    float *best_r;                /* preset paper: the denoiser of that epoch */
    struct ggn_progress progress;
    struct ggn_log log;
    float *buffer;                /* pixels of a batch */
    const float **planes;         /* pointers into it */
};

/* phase_denoiser.c, phase_judge.c: run the phase from progress.step on. */
int ggn_phase_denoiser(struct ggn_session *s, struct base_err *err);
int ggn_phase_judge(struct ggn_session *s, struct base_err *err);

/* Denoises the chains of one split (GGN_SPLITS: all) with s->r, in evaluation mode. */
int ggn_session_denoise(struct ggn_session *s, enum ggn_split split, struct base_err *err);
/* Raw logits of windows list[index[i]], i < n, with the weights as they are. */
int ggn_session_logits(struct ggn_session *s, const struct ggn_windows *windows, const int *index, int n, double *logit,
                       struct base_err *err);

/* Copies M and D (and R in preset paper) to or from `best`. */
int ggn_session_keep_best(struct ggn_session *s, struct base_err *err);
void ggn_session_load_best(struct ggn_session *s);

/* Cosine from lr down to a fiftieth, after a short warm-up; divergences halve it. */
double ggn_session_lr(const struct ggn_session *s, double lr, uint64_t step, uint64_t steps);
/* Seed of the draws. */
uint32_t ggn_session_seed(const struct ggn_session *s);
int ggn_session_interrupted(const struct ggn_session *s);
/* Writes the row, the curves and the checkpoint, and says how it goes. `samples` of the epoch took `seconds`. */
int ggn_session_epoch(struct ggn_session *s, struct ggn_log_row *row, uint64_t steps, double samples, double seconds,
                      struct base_err *err);

/* checkpoint.c */
int ggn_session_save(struct ggn_session *s, const char *path, struct base_err *err);
/* The phase first, so that the session can make the trainer of that phase; then the numbers. */
int ggn_session_saved_phase(const char *path, int *phase, struct base_err *err);
int ggn_session_restore(struct ggn_session *s, const char *path, struct base_err *err);
/* Identifies the plan and the data: a checkpoint of another run is refused. */
uint32_t ggn_session_key(const struct ggn_session *s);

/* The parts of a session as arrays, in a fixed order; NULL past the end. */
float *ggn_session_array(struct ggn_session *s, int i, size_t *count);

/* export.c: the model file and its card. */
int ggn_session_export(struct ggn_session *s, const struct ggn_policy *policy, const struct ggn_stopping *stopping, double auc,
                       double accuracy, struct base_err *err);
/* Before a phase has its trainer: the denoiser into s->r; after: generator and discriminator (preset paper: all three). */
int ggn_session_import(struct ggn_session *s, const char *path, struct base_err *err);

#endif
