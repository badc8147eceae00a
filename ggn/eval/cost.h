/*
 * What a method's accuracy costs, scene by scene: samples, thread seconds and checks spent until its blocks stop, and how
 * good the picture is then.
 *
 * Quality is told from the block's label T, the samples at which noise stops being visible: the noise of a mean falls as
 * 1/sqrt(spp), so that a block stopped at n shows sqrt(T/n) times what is just visible. Two things need pixels: FLIP, and
 * relMSE, by the same law from the recorded half buffers. Pure functions.
 */
#ifndef GGN_EVAL_COST_H
#define GGN_EVAL_COST_H

#include "eval/method.h"

/* The checks that a method makes on each block until it stops: of one that has scores, what ggn_method_run goes through.
 * out: [blocks]. */
void ggn_cost_checks(const struct ggn_method *m, const struct ggn_eval_set *s, double *out);

/* One setting on one scene; sums over its blocks where not said otherwise. */
struct ggn_cost {
    int blocks;
    double samples;                   /* per pixel, mean over the blocks */
    double sampling_s;                /* thread seconds of sampling, mean over the blocks */
    double checks;                    /* mean over the blocks */
    double noisy;                     /* share of blocks that stop below T */
    double early;                     /* share that stops below 0.8 T */
    double worst;                     /* visible difference of the worst block, 1: just visible */
    double uniform_spp;               /* samples everywhere that make the worst block as good */
    double time_ratio, samples_ratio; /* sampling alone, against those uniform samples */
    double flip, flip_worst, relmse;  /* NaN: not known */
};
/* stop: [blocks of the set]; checks: [blocks] or NULL. scene: ggn_eval_block.scene; -1: all. NaN costs without blocks. */
void ggn_cost_of(const struct ggn_eval_set *s, enum ggn_split split, int scene, const double *stop, const double *checks,
                 struct ggn_cost *out);

/* Thread seconds per sample and pixel of a block, from its last recorded level; NaN if not known. */
double ggn_cost_path_s(const struct ggn_eval_set *s, const struct ggn_eval_block *b);

#endif
