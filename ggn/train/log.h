/* Learning curves: one row per epoch, kept in the checkpoint, written as CSV. */
#ifndef GGN_TRAIN_LOG_H
#define GGN_TRAIN_LOG_H

#include "base/err.h"

extern const char *const ggn_log_phases[]; /* "denoiser", "judge" (generator and discriminator) */

struct ggn_log_row {
    int phase;                                                                             /* of ggn_log_phases */
    double step, loss, accuracy, validation_loss, validation_accuracy, validation_auc, lr; /* NaN = not measured */
    double seconds, processor_s; /* since the phase began, on this machine; only here two runs may differ */
};

struct ggn_log {
    int n;
    struct ggn_log_row *rows; /* owns */
};

int ggn_log_add(struct ggn_log *log, const struct ggn_log_row *row, struct base_err *err);
void ggn_log_release(struct ggn_log *log);
int ggn_log_write_csv(const struct ggn_log *log, const char *path, struct base_err *err);

#endif
