/*
 * A training run in progress: data, networks, the trainer of the present phase, the best epoch. Private to ggn/train.
 */
#ifndef GGN_TRAIN_SESSION_H
#define GGN_TRAIN_SESSION_H

#include "data/windows.h"
#include "model/model.h"
#include "model/trainer.h"
#include "train/train.h"

/* Learning curves: one row per epoch, kept in the checkpoint, written as CSV. */
extern const char *const ggn_log_phases[]; /* "denoiser", "judge" (generator and discriminator) */

enum { GGN_LOG_NUMBERS = 9 };

struct ggn_log_row {
    int phase; /* of ggn_log_phases */
    union {
        struct {
            double step, loss, accuracy, validation_loss, validation_accuracy, validation_auc, lr; /* NaN = not measured */
            double seconds, processor_s; /* since the phase began, on this machine; only here two runs may differ */
        };
        double numbers[GGN_LOG_NUMBERS]; /* all of them, as files have them */
    };
};

struct ggn_log {
    int n;
    struct ggn_log_row *rows; /* owns */
};

int ggn_log_add(struct ggn_log *log, const struct ggn_log_row *row, struct base_err *err);
void ggn_log_release(struct ggn_log *log);
int ggn_log_write_csv(const struct ggn_log *log, const char *path, struct base_err *err);

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
    int crop;                /* side of the denoiser's samples */
    struct ggn_hyper hyper;  /* of the model */
    struct ggn_model *init;  /* where to start from, or NULL */
    struct ggn_model *model; /* to be: the denoiser once its phase is over, of the last phase the best epoch's networks */
    struct ggn_trainer *trainer; /* of the present phase */
    struct ggn_progress progress;
    char checkpoint_path[4096];
    struct ggn_container checkpoint; /* owns; what the run goes on from, until its phase has read it */
    struct ggn_log log;
    float *buffer;        /* pixels of a batch */
    const float **planes; /* pointers into it */
    double scale;         /* with plan->reach: of the logistic, per octave of noise */
};

/* Loads the data and checks the plan against it. `session` has plan, path and phase; release it after a failure, too. */
int ggn_session_init(struct ggn_session *session, struct base_err *err);
void ggn_session_release(struct ggn_session *session);
/* Loads plan->init: a model of the same networks. */
int ggn_session_load_init(struct ggn_session *session, struct base_err *err);

/* Makes the trainer of a phase with the networks GGN_TRAIN_* for blocks of height × width, in the place of the former. */
int ggn_session_begin(struct ggn_session *session, int parts, int batch, int height, int width, struct base_err *err);

/* Cosine from lr down to a fiftieth, after a short warm-up; divergences halve it. */
double ggn_session_lr(const struct ggn_session *session, double lr, uint64_t step, uint64_t steps);
/* With plan->reach: log2 of the law's error at level k. */
double ggn_session_law(const struct ggn_session *session, const struct ggn_level_series *series, int k);
/* Seed of the draws. */
uint32_t ggn_session_seed(const struct ggn_session *session);
/* With the weights of the best epoch: calibration and stopping policy on the validation scenes, model file and card. */
int ggn_session_finish(struct ggn_session *session, struct base_err *err);

#endif
