/* A trained model as a method of evaluation: every block's levels go through it as they would in the renderer. */
#ifndef GGN_EVAL_TRAINED_H
#define GGN_EVAL_TRAINED_H

#include "eval/method.h"
#include "model/inference.h"
#include "model/policy.h"
#include "observer/observer.h"

/*
 * Scores are p_noisy of every window that the policy's cadence makes (data/replay.h); cut and passes are the policy's.
 * A residual model asks between levels too, where the law is known; it needs set->images.meter. observers: of its law, that
 * of each view.
 */
int ggn_eval_trained(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model,
                     const struct ggn_policy *policy, const char *name, enum ggn_precision precision,
                     const struct ggn_observer *observers, struct base_threads *threads, struct base_err *err);

#endif
