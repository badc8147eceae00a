/*
 * The published models before the network as methods of evaluation: trained on the training scenes' cases, judged on all.
 *
 * 26 attributes + SVM (Constantin et al. 2015), noise mask + SVM (Takouachet et al. 2017), SVD-entropy + LSTM (Buisine et
 * al. 2021). Everything is seeded; results do not depend on the number of threads.
 */
#ifndef GGN_BASELINES_LEARNED_H
#define GGN_BASELINES_LEARNED_H

#include "eval/method.h"

/* Each trains on the blocks of `split` and gives every case a score. BASE_EINVAL when that split lacks one of the classes.
 * The cut is to be tuned afterwards. */
int ggn_method_attributes_svm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                              struct base_threads *threads, struct base_err *err);
int ggn_method_mask_svm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                        struct base_threads *threads, struct base_err *err);
/* epochs: passes over the training cases (published: 30). interval [first, 20) of the singular values: 0 or 5. */
int ggn_method_svd_lstm(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, int first, int epochs,
                        struct base_threads *threads, struct base_err *err);

#endif
