/*
 * What is evaluated: every labelled block of a data set at every level a method may judge it ("case"), and how good the image is
 * there. Cases of one block are consecutive and rise in spp.
 */
#ifndef GGN_EVAL_SET_H
#define GGN_EVAL_SET_H

#include "base/threads.h"
#include "data/dataset.h"

struct ggn_eval_block {
    int view;          /* index into data->views */
    int scene;         /* index that equal scene names share */
    uint32_t index;    /* in the view's manifest */
    enum ggn_split split;
    struct ggn_label label;
    double cap;        /* last level, spp */
    size_t first, end; /* its cases */
};

struct ggn_eval_set {
    const struct ggn_dataset *data; /* borrows */
    int window;                     /* S: the first S-1 levels of a block make no case */
    int n_blocks, n_scenes;
    struct ggn_eval_block *blocks;  /* owns; ordered by view, then as the manifest lists them */
    size_t n;                       /* cases */
    double *spp, *seconds;          /* own; [n]; seconds: thread time spent on the block so far, NaN if unknown */
    signed char *noisy;             /* owns; [n]: 1, 0, or -1 unknown */
    double *dammertz, *half_unsettled, *rse, *rse_unsettled; /* own; [n]; NaN where not recorded */
    double *flip, *ssim;            /* own; [n]: against the block's reference; NaN unless asked for */
};

/* Views without labels are left out (and so counted in *skipped). quality: also compute FLIP and SSIM of every case. GGN_EINVAL if
 * nothing is left. Parallel over blocks; the same result for any number of threads. */
int ggn_eval_set_load(struct ggn_eval_set *set, const struct ggn_dataset *data, int window, int quality, struct ggn_threads *threads,
                      int *skipped, struct ggn_err *err);
void ggn_eval_set_release(struct ggn_eval_set *set);

/* Calls fn for each block with its pixels loaded, in parallel; stops at the first error (in order of blocks). */
int ggn_eval_each_block(const struct ggn_eval_set *set, struct ggn_threads *threads,
                        int (*fn)(void *data, int block, const struct ggn_seq_block *pixels, int worker, struct ggn_err *err), void *data,
                        struct ggn_err *err);

#endif
