/*
 * Methods that say from an image whether its noise is still seen, and what their decisions are worth.
 *
 * A method gives every case a score (higher: noisier). A block stops at the first case that ends a row of `passes` scores
 * below the cut and that no guard holds back, and never later than its last level. Methods without scores give a stop per
 * block directly.
 */
#ifndef GGN_EVAL_METHOD_H
#define GGN_EVAL_METHOD_H

#include "eval/set.h"
#include "figures/stats.h"
#include "observer/observer.h"

enum { GGN_METHOD_NAME = 48 };

struct ggn_method {
    char name[GGN_METHOD_NAME];
    double *score;       /* owns; [cases]; NaN: not judged there. NULL: fixed stops only */
    double *correction;  /* owns; [cases]: octaves of noise that a residual model adds to the law's; NULL: no such model */
    const double *guard; /* borrowed from the set; [cases]; the block is held back while it exceeds guard_limit;
                            NULL: none */
    double guard_limit;
    int passes;    /* cases in a row below the cut that stop a block, >= 1 */
    double cut;    /* the block goes on while score >= cut */
    double *stop;  /* owns; [blocks], spp */
    double *asked; /* owns; [blocks]: checks until there, of a method that asks at counts of its own; else NULL */
    int is_oracle; /* it knows the answers */
};

void ggn_method_release(struct ggn_method *m);

/* Trivial baselines. score = -spp (reads no pixel); the median threshold of the training blocks; the mean threshold of
 * the block's own scene (an oracle). GGN_SPLIT_NONE stands for training when there are no training blocks. */
int ggn_method_spp(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err);
int ggn_method_constant(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err);
int ggn_method_scene_mean(struct ggn_method *m, const struct ggn_eval_set *s, struct base_err *err);
/* The criteria of plugin-api/examples from their recorded errors; *available: whether every case has them. */
int ggn_method_halfbuf(struct ggn_method *m, const struct ggn_eval_set *s, int *available, struct base_err *err);
int ggn_method_variance(struct ggn_method *m, const struct ggn_eval_set *s, int *available, struct base_err *err);
/* The criterion `observer`: stops when at most the share `visible` of viewers would still see noise. growth: largest ratio
 * of samples between two checks (the criterion's default: GGN_OBSERVER_GROWTH). path: the observer's file, of which views
 * that had a part in the fit get the parameters without them; NULL: built in. halves 0: as in a host without half buffers.
 */
#define GGN_OBSERVER_GROWTH 1.5
int ggn_method_observer(struct ggn_method *m, const struct ggn_eval_set *s, const char *path, int halves, double visible,
                        double growth, int *available, struct base_err *err);
/* Where the law stops block b, asking at sample counts of its own (*asked of them, if not NULL) from first_spp on: where its
 * error falls to stop_error. correction: [cases] octaves of noise that a network adds from a case to the next, where it is
 * asked at the latest; NULL: none. seen: [cases] set->visible or visible_means. */
double ggn_method_law_stop(const struct ggn_observer *observer, const struct ggn_eval_set *s, const double *seen,
                           const struct ggn_eval_block *block, double stop_error, const double *correction, double first_spp,
                           double growth, double *asked);
/* The observer that judges a view: from the file at `path`, without the view where it was fitted; NULL: built in. */
int ggn_method_observer_of(const char *path, const struct ggn_eval_set *s, const struct ggn_eval_block *block,
                           struct ggn_observer *observer, struct base_err *err);
/* Thresholds from a file, matched by the view's name (SIN3D's own names end in _part6); available: it has every view of
 * `split`. Views that it does not have stop at their cap. BASE_EINVAL where a view has another number of thresholds than
 * blocks. */
int ggn_method_thresholds(struct ggn_method *m, const struct ggn_eval_set *s, const char *path, enum ggn_split split,
                          int *available, struct base_err *err);
/* An empty method with room for stops and, if asked, scores. */
int ggn_method_init(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, int with_scores,
                    struct base_err *err);

/* Sets stop from score, guard, passes and cut, as the stopping rule ends (ggn_stopper_pass). */
void ggn_method_run(struct ggn_method *m, const struct ggn_eval_set *s);
/* Chooses the cut on the blocks of `split`: the one that spends fewest samples with at most `early_rate` of the blocks
 * stopped below 0.8 of their threshold; if none does, the smallest early rate. The limit of a guard is chosen with it. Then
 * runs. */
int ggn_method_tune(struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split, double early_rate,
                    struct base_err *err);

struct ggn_method_metrics {
    int blocks, censored, scenes;
    size_t cases;               /* with a known label */
    double auc, auc_scene_mean; /* pooled over all cases; mean of the scenes that have both classes */
    double accuracy;            /* of "score >= cut" */
    double best_accuracy;
    struct ggn_agreement agreement; /* on blocks that are not censored */
    double early_stop_rate;         /* on all blocks: a censored one counts when it stops below 0.8 of the cap */
    double samples_ratio;           /* on all blocks */
    double flip_mean, flip_worst, ssim_mean, ssim_worst;     /* at the stop, over blocks */
    double uniform_spp, time_vs_uniform, samples_vs_uniform; /* uniform sampling whose worst block is as good (FLIP) */
};

/* BASE_EINVAL when the split has no blocks. Undefined figures are NaN. */
int ggn_method_measure(const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                       struct ggn_method_metrics *out, struct base_err *err);

/* What is held against the cut in case i; NaN: it was not judged there. */
double ggn_method_verdict(const struct ggn_method *m, size_t i);
/* Whether case i says that its block may stop: below the cut and not held back. */
int ggn_method_passes(const struct ggn_method *m, size_t i);

/* The case of block b at which it stops (spp >= stop), the last if none. */
size_t ggn_method_stop_case(const struct ggn_method *m, const struct ggn_eval_set *s, int b);
int ggn_eval_count(const struct ggn_eval_set *s, enum ggn_split split);

#endif
