/*
 * The published models before the network on a data set: training, and as methods of evaluation that judge the blocks'
 * levels by the one stopping rule (data/replay.h), as the criteria of the same names do in a renderer.
 *
 * Everything is seeded; results do not depend on the number of threads.
 */
#ifndef GGN_BASELINES_LEARNED_H
#define GGN_BASELINES_LEARNED_H

#include "baselines/baseline.h"
#include "eval/method.h"

/* Scores: p_noisy of every case; cut and passes are the policy's. */
int ggn_method_baseline(struct ggn_method *m, const struct ggn_eval_set *s, struct ggn_baseline *b,
                        struct base_threads *threads, struct base_err *err);

/* Trains a baseline of one kind on the cases of `split`, for blocks and windows of the set's size: weights, calibration
 * (Platt's, on the validation scenes if there are any), cadence, and the threshold with at most `early` of the blocks of
 * `split` stopped early (ggn_method_tune). epochs: of the LSTM (published: 30). The caller owns both on success. BASE_EINVAL
 * when the split lacks one of the classes. */
int ggn_method_learned(struct ggn_method *m, struct ggn_baseline *b, const struct ggn_eval_set *s,
                       enum ggn_baseline_kind kind, enum ggn_split split, double early, int epochs,
                       struct base_threads *threads, struct base_err *err);

#endif
