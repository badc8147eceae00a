/*
 * The images of training: level series, each one block at rising sample counts with the label that tells where its noise
 * stops being visible.
 *
 * Real series are recorded levels. Synthetic ones are made from a recorded pair (ggn_series_set_add_synthetic): levels that
 * were never rendered, with other noise each time. The set owns everything; read-only after loading except for `denoised`.
 */
#ifndef GGN_DATA_SERIES_H
#define GGN_DATA_SERIES_H

#include <stddef.h>
#include <stdint.h>

#include "data/dataset.h"
#include "sight/measure.h"
#include "model/policy.h"

struct ggn_level_series {
    int view, scene, synthetic;
    int simulated; /* the recording had no reference: all levels are made from its two halves */
    enum ggn_split split;
    uint32_t block;
    int n_levels;
    double *spp;        /* [n_levels], rising */
    uint8_t *noisy;     /* [n_levels][3][H][W] display codes */
    uint16_t *denoised; /* the same, 16-bit fixed point; NULL until needed */
    /* [3][H][W] display codes; NULL without; a synthetic series shares its original's. Where none was recorded
     * (has_reference 0) the mean of the full level stands for it: as noisy as that many samples are, which levels recorded
     * below it share */
    uint8_t *reference;
    int has_reference;
    /* with set->noise_maps: the noise maps (of the visible noise, sight/measure.h),
     * [n_levels][H][W], and whether a level has one */
    uint8_t *noise_map, *has_noise_map;
    struct ggn_measure *measure; /* [n_levels], with set->meter; visible is NaN where there are no halves */
    int has_label;
    struct ggn_label label;
    double spread; /* octaves, for soft labels */
};

struct ggn_series_set {
    struct ggn_dataset data; /* the views */
    int width, height;       /* of every block */
    int noise_maps;          /* series have noise maps */
    int keep_recorded;       /* see ggn_series_set_options */
    struct ggn_meter meter;  /* with memory: series have measures */
    int n;
    enum ggn_split_source split_source;
    struct ggn_level_series *series;
    double first_spp, ratio, step_spp; /* how real levels are spaced: ratio, or (ratio 0) a constant step */
    int n_levels;                      /* those that are not, see ggn_policy */
    double level[GGN_POLICY_LEVELS];
};

struct ggn_series_set_options {
    const char *dir; /* a data set (data/dataset.h) */
    struct ggn_split_options split;
    double ratio;      /* thin the levels to at least this ratio; 0: keep all */
    int noise_maps;    /* with measures: also keep the noise maps */
    int measures;      /* also measure every level (sight/measure.h) */
    int keep_recorded; /* ggn_series_set_extend makes what it simulates further series */
    int with_test;     /* read the pixels of the test scenes and of the people's views too; else some must be for training */
};

/* Reads and checks everything. BASE_EINVAL names the file that does not fit. */
int ggn_series_set_load(struct ggn_series_set *set, const struct ggn_series_set_options *options, struct base_err *err);
void ggn_series_set_release(struct ggn_series_set *set);

/* Adds `per_series` synthetic series for each training series whose sequence has a full level and an independent reference.
 * The same seed gives the same series. */
int ggn_series_set_add_synthetic(struct ggn_series_set *set, int per_series, uint32_t seed, struct base_err *err);

/* Continues recorded series of all splits that end near or before their threshold (all: every labelled one, also where
 * training has no use for it), up to 0.7 of the reference's samples beyond the last level: the reference's samples go on
 * where the recording stopped, their running mean simulated from the half buffers. Where there is no reference but a full
 * level, the whole series is made anew, up to SEQ_SIMULATED_CAP: its mean stands for the converged image. With
 * set->keep_recorded that is a further, synthetic series, and the recorded one stays: its levels have noise of their own. */
int ggn_series_set_extend(struct ggn_series_set *set, int all, uint32_t seed, struct base_err *err);

/* Makes every labelled series that has a full level anew, its levels `ratio` > 1 apart and up to SEQ_SIMULATED_CAP: from
 * the two halves alone, so that series with and without a reference are made alike. The same seed gives the same series. */
int ggn_series_set_simulate(struct ggn_series_set *set, double ratio, uint32_t seed, struct base_err *err);

/* How blocks are to be asked about: at the levels of the set. */
void ggn_series_set_pace(const struct ggn_series_set *set, struct ggn_policy *policy);

/* Series of a split, real ones only if real_only. */
int ggn_series_set_count(const struct ggn_series_set *set, enum ggn_split split, int real_only);
/* Values of one image: 3·H·W. */
size_t ggn_series_set_values(const struct ggn_series_set *set);

/* CRC-32 of the images and labels. */
uint32_t ggn_series_set_crc(const struct ggn_series_set *set);

/* Makes room for n levels, or for more. */
int ggn_series_grow(const struct ggn_series_set *set, struct ggn_level_series *series, int n, struct base_err *err);
/* With set->meter: measures level k, whose two pictures are mean + and - scale * D (linear, [3][H][W]), and makes its noise
 * map. keep_texture: see ggn_measure. */
void ggn_series_measure(const struct ggn_series_set *set, struct ggn_level_series *series, int k, const float *mean,
                        const float *d, double scale, int keep_texture);

/* Appends an empty series, which is the last then. Pointers to series are invalid afterwards. */
int ggn_series_set_append(struct ggn_series_set *set, struct base_err *err);

#endif
