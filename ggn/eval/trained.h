/* A trained model as a method of evaluation: every block's levels go through it as they would in the renderer. */
#ifndef GGN_EVAL_TRAINED_H
#define GGN_EVAL_TRAINED_H

#include "eval/method.h"
#include "model/exact.h"
#include "model/inference.h"
#include "model/policy.h"

/*
 * Scores are p_noisy of every window that the policy's cadence makes; stops are those of the rule (model/stopper.h,
 * data/replay.h).
 * A residual model asks between levels too, where the law is known; it needs set->images.meter. observer: of its law, as for
 * ggn_method_observer.
 */
int ggn_eval_trained(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model,
                     const struct ggn_policy *policy, const char *name, enum ggn_precision precision, const char *observer,
                     struct base_threads *threads, struct base_err *err);
/* Sets the stops of a residual model's method once more, for another m->cut; what ggn_method_run is to other methods.
 * policy and observer: those that it was made with. */
int ggn_eval_trained_stop(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_policy *policy,
                          const char *observer, struct base_err *err);

#endif
