/* What the phases of a training have in common: epochs of steps, each closed by a validation, the curves and a checkpoint.
 */
#ifndef GGN_TRAIN_PHASE_H
#define GGN_TRAIN_PHASE_H

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

/* From progress.step to the end. After a divergence the epoch is repeated with half the learning rates and other draws. */
int ggn_phase_run(struct ggn_session *session, const struct ggn_phase *phase, struct base_err *err);

#endif
