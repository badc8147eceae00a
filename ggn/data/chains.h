/*
 * The images that training sees: chains, each one block at rising sample counts with the label that tells where its noise
 * stops being visible.
 *
 * Real chains are recorded levels. Synthetic ones are made from a recorded pair (ggn_chains_add_synthetic): levels that were
 * never rendered, with other noise each time. The set owns everything; read-only after loading except for `denoised`.
 */
#ifndef GGN_DATA_CHAINS_H
#define GGN_DATA_CHAINS_H

#include <stddef.h>
#include <stdint.h>

#include "data/dataset.h"

struct ggn_chain {
    int view, scene, synthetic;
    int simulated; /* the recording had no reference: all levels are made from its two halves */
    enum ggn_split split;
    uint32_t block;
    int n_levels;
    double *spp;        /* [n_levels], rising */
    uint8_t *noisy;     /* [n_levels][3][H][W] display codes */
    uint16_t *denoised; /* the same, 16-bit fixed point; NULL until needed */
    uint8_t *reference; /* [3][H][W] display codes; NULL without; a synthetic chain shares its original's */
    /* with set->pictures: the noise pictures (model/window.h), [n_levels][H][W], and whether a level has one */
    uint8_t *picture, *has_picture;
    double *tail999, *gini; /* [n_levels], NaN where not recorded */
    int has_label;
    struct ggn_label label;
    double spread; /* octaves, for soft labels */
};

struct ggn_chains {
    struct ggn_dataset data; /* the views */
    int width, height;       /* of every block */
    int pictures;            /* chains have noise pictures */
    int n, n_scenes;
    struct ggn_chain *chains;
    double first_spp, ratio, step_spp; /* how real levels are spaced: ratio, or (ratio 0) a constant step */
};

struct ggn_chains_options {
    const char *dir; /* a data set (data/dataset.h) */
    /* comma-separated scenes: over the data set's split; NULL: the split, or every fifth scene without */
    const char *validation;
    const char *test; /* likewise; NULL: the split, or none */
    double ratio;     /* thin the levels to at least this ratio; 0: keep all */
    int pictures;     /* also make the noise pictures */
    /* where there is no reference, the mean of the full level stands for it: as noisy as that many samples are, which
     * levels recorded below it share */
    int mean_for_reference;
    int with_test; /* read the pixels of the test scenes and of the people's views too (training never does) */
};

/* Reads and checks everything. BASE_EINVAL names the file that does not fit. */
int ggn_chains_load(struct ggn_chains *set, const struct ggn_chains_options *options, struct base_err *err);
void ggn_chains_release(struct ggn_chains *set);

/* Adds `per_chain` synthetic chains for each training chain whose sequence has a full level and an independent reference.
 * The same seed gives the same chains. */
int ggn_chains_add_synthetic(struct ggn_chains *set, int per_chain, uint32_t seed, struct base_err *err);

/* Continues recorded chains of all splits that end near or before their threshold, up to 0.7 of the reference's samples
 * beyond the last level: the reference's samples go on where the recording stopped, their running mean simulated from the
 * half buffers. Where there is no reference but a full level, the whole chain is made anew, up to SEQ_SIMULATED_CAP: its
 * mean stands for the converged image. */
int ggn_chains_extend(struct ggn_chains *set, uint32_t seed, struct base_err *err);

/* Makes every labelled chain that has a full level anew, its levels `ratio` > 1 apart and up to SEQ_SIMULATED_CAP: from
 * the two halves alone, so that chains with and without a reference are made alike. The same seed gives the same chains. */
int ggn_chains_simulate(struct ggn_chains *set, double ratio, uint32_t seed, struct base_err *err);

/* Chains of a split, real ones only if real_only. */
int ggn_chains_count(const struct ggn_chains *set, enum ggn_split split, int real_only);
/* Values of one image: 3·H·W. */
size_t ggn_chains_values(const struct ggn_chains *set);

/* Makes room for n levels, or for more. */
int ggn_chain_grow(const struct ggn_chains *set, struct ggn_chain *chain, int n, struct base_err *err);
/* With set->pictures: the noise picture of level k, from the luminance of its mean and of a half difference D (linear,
 * [H][W]) whose noise is that of `scale`⁻² times fewer samples: scale = √(N/n) takes D from N samples to n. */
void ggn_chain_set_picture(const struct ggn_chains *set, struct ggn_chain *chain, int k, const float *mean, const float *d,
                           double scale);

/* Appends an empty chain; NULL: out of memory. Pointers to chains are invalid afterwards. */
struct ggn_chain *ggn_chains_append(struct ggn_chains *set, struct base_err *err);

#endif
