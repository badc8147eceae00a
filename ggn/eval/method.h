/*
 * Methods that say from an image whether its noise is still seen, and the cut at which their answers stop blocks.
 *
 * A method gives every case a score (higher: noisier). A block stops at the first case that ends a row of `passes` scores
 * below the cut, and never later than its last level. What else stops can be worth, lull/judge says of what `ggn replay`
 * prints.
 */
#ifndef GGN_EVAL_METHOD_H
#define GGN_EVAL_METHOD_H

#include "eval/set.h"
#include "model/inference.h"
#include "model/policy.h"
#include "sight/observer.h"

enum { GGN_METHOD_NAME = 48 };

struct ggn_method {
    char name[GGN_METHOD_NAME];
    double *score;      /* owns; [cases]; NaN: not judged there */
    double *correction; /* owns; [cases]: octaves of noise that a residual model adds to the law's; NULL: no such model */
    int passes;         /* cases in a row below the cut that stop a block, >= 1 */
    double cut;         /* the block goes on while score >= cut */
};

/* Room for scores, and for corrections if asked. */
int ggn_method_init(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, int with_correction,
                    struct base_err *err);
void ggn_method_release(struct ggn_method *m);

/* Chooses the cut on the blocks of `split`: the one that spends fewest samples with at most `early_rate` of the blocks
 * stopped below 0.8 of their threshold; if none does, the smallest early rate. BASE_EINVAL: no score there. */
int ggn_method_tune(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double early_rate,
                    struct base_err *err);

/* A trained model as a method: every block's levels go through it as they would in the renderer. Scores are p_noisy of every
 * window that the policy's cadence makes (data/replay.h); cut and passes are the policy's. A residual model asks between
 * levels too, where the law is known; it needs set->images.meter. observers: of its law, that of each view. */
int ggn_eval_trained(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model,
                     const struct ggn_policy *policy, const char *name, enum ggn_precision precision,
                     const struct ggn_observer *observers, struct base_threads *threads, struct base_err *err);

struct ggn_method_figures {
    int blocks, scenes;
    size_t windows;         /* with a known label */
    double auc;             /* over all of them; NaN: of one class alone */
    double early_stop_rate; /* share of blocks stopped below 0.8 of the threshold */
    double samples_ratio;   /* samples over samples at the thresholds */
};

int ggn_method_measure(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                       struct ggn_method_figures *out, struct base_err *err);

#endif
