/* What the phases of a training have in common: epochs of steps, each closed by a validation, the curves and a checkpoint.
 */
#ifndef GGN_TRAIN_PHASE_H
#define GGN_TRAIN_PHASE_H

#include "model/policy.h"
#include "train/session.h"

struct ggn_phase {
    uint64_t steps, epoch_steps;
    int batch; /* samples per step */
    int net;   /* whose learning rate is reported */
    /* One step; *loss and *right (share of samples on the right side, NaN if there is none) before it. */
    int (*step)(struct ggn_session *session, uint64_t step, uint64_t steps, double *loss, double *right,
                struct base_err *err);
    /* Fills the row's validation figures and notes the best epoch. */
    int (*validate)(struct ggn_session *session, struct ggn_log_row *row, struct base_err *err);
};

/* From progress.step and the weights as they are to the end. After a divergence the epoch is repeated with half the learning
 * rates and other draws. */
int ggn_phase_run(struct ggn_session *session, const struct ggn_phase *phase, struct base_err *err);

/*
 * OUT.ckpt: everything that continuing a run bit-exactly needs, as a .ggn file (model/container.h): the arrays that a phase
 * changes as tensors "0", "1", …, progress, optimiser counts and learning curves as JSON of "kind": "training".
 */
int ggn_resume_save(struct ggn_session *session, struct base_err *err);
/* With plan->resume: reads it, if it is there, and sets the phase, so that a trainer of that phase can be made. */
int ggn_resume_open(struct ggn_session *session, struct base_err *err);
/* Then takes over the numbers, if it was there. */
int ggn_resume_load(struct ggn_session *session, struct base_err *err);

/* Phase 0 of preset lull: the denoiser, on crops of noisy images and their references. Leaves it in session->model. */
int ggn_phase_denoiser(struct ggn_session *session, struct base_err *err);

/* Phase 1: generator and discriminator, on windows whose denoised images are computed once; in preset paper all three
 * networks at once. Leaves the weights of the best epoch in place. */
int ggn_phase_classifier(struct ggn_session *session, struct base_err *err);

/* Windows of the validation scenes as the networks see them. */
struct ggn_classified {
    double *logit;            /* [windows] ggn_trainer_answers; owns */
    double auc;               /* NaN without both classes */
    double loss, accuracy;    /* of the calibrated probability; NaN without windows */
    struct ggn_policy policy; /* calibrated: as the law, with a residual, else fitted to the labels */
};
/* Judges evenly strided ones, at most `most`, with the weights as they are. The caller frees `logit`, also on failure. */
int ggn_classify_validation(struct ggn_session *session, int most, struct ggn_classified *out, struct base_err *err);

#endif
