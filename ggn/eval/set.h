/*
 * What is evaluated: every labelled block of a data set at every level a method may judge it ("case"), and how good the
 * image is there. Cases of one block are consecutive and rise in spp.
 */
#ifndef GGN_EVAL_SET_H
#define GGN_EVAL_SET_H

#include "base/threads.h"
#include "data/series.h"

struct ggn_eval_block {
    int series;     /* index into images.series */
    int view;       /* index into images.data.views */
    uint32_t index; /* in the view's manifest */
    enum ggn_split split;
    struct ggn_label label; /* thresholds beyond the last level are censored there */
    double cap;             /* last level, spp */
    size_t first, end;      /* its cases */
};

struct ggn_eval_set {
    struct ggn_series_set images; /* owns: the images, continued beyond the recording where possible */
    int window;                   /* S: the first S-1 levels of a block make no case */
    int n_blocks;
    struct ggn_eval_block *blocks; /* owns; ordered by view, then as the manifest lists them */
    size_t n;                      /* cases */
    double *spp, *seconds;         /* own; [n]; seconds: thread time spent on the block so far, NaN if unknown */
    signed char *noisy;            /* owns; [n]: 1, 0, or -1 unknown */
    double *dammertz, *half_unsettled, *rse, *rse_unsettled; /* own; [n]; NaN where not recorded */
    double *visible;       /* owns; [n]: noise that the model observer sees (sight/visibility.h); NaN without halves */
    double *visible_means; /* owns; [n]: the same in a host without half buffers; NaN without levels to tell it */
    const double *law;     /* visible or visible_means: what residual models begin with */
    double *flip, *ssim;   /* own; [n]: against the reference, else the mean of the full level; NaN unless asked for */
    double *relmse;        /* owns; [n]: variance over the squared mean, from the full level's halves; NaN without */
};

struct ggn_eval_options {
    struct ggn_series_set_options data;
    int window;         /* S */
    int quality;        /* also compute FLIP and SSIM of every case ... */
    int no_ssim;        /* ... but SSIM, which takes longer */
    int recorded;       /* only recorded levels; else each block goes on as ggn_series_set_extend says */
    double cadence;     /* > 1: simulate all levels, this far apart (ggn_series_set_simulate); 0: no */
    uint32_t seed;      /* of the continuation */
    int without_halves; /* residual models judge as in a host without half buffers */
};

/* Blocks without a label are left out; *skipped counts the views without any. BASE_EINVAL if nothing is left. Errors of the
 * criteria at levels beyond the recording are scaled from the last recorded one (by the square root of the samples). The
 * same result for any number of threads. */
int ggn_eval_set_load(struct ggn_eval_set *set, const struct ggn_eval_options *options, struct base_threads *threads,
                      int *skipped, struct base_err *err);
void ggn_eval_set_release(struct ggn_eval_set *set);

int ggn_eval_count(const struct ggn_eval_set *s, enum ggn_split split);

#endif
