/*
 * What is evaluated: every labelled block of a data set at every level a method may judge it ("case"), and how good the
 * image is there. Cases of one block are consecutive and rise in spp.
 */
#ifndef GGN_EVAL_SET_H
#define GGN_EVAL_SET_H

#include "job/job.h"
#include "base/threads.h"
#include "data/series.h"

struct ggn_eval_block {
    int series;     /* index into images.series */
    int view;       /* index into images.data.views */
    int scene;      /* index that equal scene names share */
    uint32_t index; /* in the view's manifest */
    enum ggn_split split;
    struct ggn_label label; /* thresholds beyond the last level are censored there */
    double cap;             /* last level, spp */
    size_t first, end;      /* its cases */
};

/* spp as thresholds of this block are compared: those of views that people judged in samples of their study
 * (observer/observer.h), all others as they are. */
double ggn_eval_compared(const struct ggn_eval_block *block, double spp);

struct ggn_eval_set {
    struct job *job;              /* borrows; NULL: alone */
    struct ggn_series_set images; /* owns: the images, continued beyond the recording where possible */
    int window;                   /* S: the first S-1 levels of a block make no case */
    int n_blocks, n_scenes;
    struct ggn_eval_block *blocks; /* owns; ordered by view, then as the manifest lists them */
    size_t n;                      /* cases */
    double *spp, *seconds;         /* own; [n]; seconds: thread time spent on the block so far, NaN if unknown */
    signed char *noisy;            /* owns; [n]: 1, 0, or -1 unknown */
    double *dammertz, *half_unsettled, *rse, *rse_unsettled; /* own; [n]; NaN where not recorded */
    double *visible;       /* owns; [n]: noise that the model observer sees (model/visibility.h); NaN without halves */
    double *visible_means; /* owns; [n]: the same in a host without half buffers; NaN without levels to tell it */
    const double *law;     /* visible or visible_means: what residual models begin with */
    double *flip, *ssim;   /* own; [n]: against the reference, else the mean of the full level; NaN unless asked for */
    double *relmse;        /* owns; [n]: variance over the squared mean, from the full level's halves; NaN without */
};

struct ggn_eval_options {
    const char *dir; /* data set */
    struct ggn_split_options split;
    int window;               /* S */
    int quality;              /* also compute FLIP and SSIM of every case ... */
    int no_ssim;              /* ... but SSIM, which takes longer */
    int recorded;             /* only recorded levels; else each block goes on as ggn_series_set_extend says */
    double ratio;             /* thin the levels to at least this ratio; 0: keep all */
    double cadence;           /* > 1: simulate all levels, this far apart (ggn_series_set_simulate); 0: no */
    uint32_t seed;            /* of the continuation */
    int noise_maps;           /* also make the noise maps (data/series.h) */
    int without_halves;       /* residual models judge as in a host without half buffers */
    int measures;             /* also measure the levels (data/series.h) */
    struct job *job;          /* the processes that share out the blocks, all with the same data; NULL: alone */
    const char *const *files; /* [n_files] what else must be the same for all of them (data/agree.h) */
    int n_files;
};

/* Blocks without a label are left out; *skipped counts the views without any. BASE_EINVAL if nothing is left. Errors of the
 * criteria at levels beyond the recording are scaled from the last recorded one (by the square root of the samples). The
 * same result for any number of threads. */
int ggn_eval_set_load(struct ggn_eval_set *set, const struct ggn_eval_options *options, struct base_threads *threads,
                      int *skipped, struct base_err *err);
void ggn_eval_set_release(struct ggn_eval_set *set);

/* Values that are made block by block: those of block b, of `size` bytes each, lie from begin[b] to begin[b + 1],
 * begin [n_blocks + 1]; NULL: one value for each case. */
struct ggn_eval_values {
    void *values;
    size_t size;
    const size_t *begin;
};

/* Calls fn for each block, in parallel and shared out to the processes of the job; returns the first error (in order of
 * blocks). What fn has put into values[n_values] all processes have then. */
int ggn_eval_each_block(const struct ggn_eval_set *set, struct base_threads *threads,
                        int (*fn)(void *data, int block, int worker, struct base_err *err), void *data,
                        const struct ggn_eval_values *values, int n_values, struct base_err *err);

#endif
