/*
 * Phase 1: generator and discriminator, on windows whose denoised images are computed once; in preset paper all three
 * networks at once.
 */
#ifndef GGN_TRAIN_PHASE_CLASSIFIER_H
#define GGN_TRAIN_PHASE_CLASSIFIER_H

#include "model/policy.h"
#include "train/session.h"

/* checkpoint: where to continue from, or NULL. Leaves the weights of the best epoch in place. */
int ggn_phase_classifier(struct ggn_session *session, const char *checkpoint, struct base_err *err);

/* Windows of a list as the networks see them. */
struct ggn_classified {
    int n;
    double *logit, *label; /* [n] ggn_trainer_answers; label of the window; own */
    unsigned char *noisy;  /* [n] own */
    double auc;            /* NaN without both classes */
};
/* Judges evenly strided windows of the validation scenes, at most `most`, with the weights as they are. Release it also
 * after a failure. */
int ggn_classify_validation(struct ggn_session *session, int most, struct ggn_classified *out, struct base_err *err);
/* The logistic of these: as the law's, with a residual, else fitted to the labels. */
void ggn_session_calibrate(const struct ggn_session *session, const struct ggn_classified *judged,
                           struct ggn_policy *policy);
void ggn_classified_release(struct ggn_classified *judged);

#endif
