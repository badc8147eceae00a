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

/* A baseline's features of every level of a set's blocks: [level][size]. */
struct ggn_feature_set {
    size_t size;   /* numbers per level */
    size_t *first; /* owns; [blocks + 1]: row of the block's level 0 */
    double *x;     /* owns; [rows][size] */
};

int ggn_feature_set_make(struct ggn_feature_set *features, const struct ggn_baseline *b, const struct ggn_eval_set *s,
                         struct base_threads *threads, struct base_err *err);
void ggn_feature_set_release(struct ggn_feature_set *features);

/* Trains an empty baseline on the cases of `split`: weights, calibration (Platt's, on the validation scenes if there are
 * any) and cadence; the threshold stays at 0.5. epochs: of the LSTM (published: 30). BASE_EINVAL when the split lacks one of
 * the classes. */
int ggn_baseline_train(struct ggn_baseline *b, const struct ggn_feature_set *features, const struct ggn_eval_set *s,
                       enum ggn_split split, int epochs, struct base_err *err);

/* Scores: p_noisy of every case; cut and passes are the policy's. */
int ggn_method_baseline(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_baseline *b,
                        const struct ggn_feature_set *features, struct base_threads *threads, struct base_err *err);

/* All of that for one kind, on blocks and windows of the set's size, and the threshold with at most `early` of the blocks of
 * `split` stopped early (ggn_method_tune). The caller owns both on success. */
int ggn_method_learned(struct ggn_method *m, struct ggn_baseline *b, const struct ggn_eval_set *s,
                       enum ggn_baseline_kind kind, enum ggn_split split, double early, int epochs,
                       struct base_threads *threads, struct base_err *err);

#endif
