/*
 * Windows of a data set: which there are, what their label is, which ones a training step sees, and their pixels.
 *
 * What step s draws is a function of (seed, s) alone, so that a resumed run draws the same. Read-only after create.
 */
#ifndef GGN_DATA_WINDOWS_H
#define GGN_DATA_WINDOWS_H

#include "data/series.h"

struct ggn_window {
    int series, last; /* images last − S + 1 … last of the series */
    double label;     /* 1 = still noisy, 0 = not; between near the threshold */
    int noisy;        /* the hard label, which evaluation counts */
    double octave;    /* log2(spp of the judged image / threshold) */
};

struct ggn_windows {
    const struct ggn_series_set *set; /* borrows */
    int length;                       /* S */
    int n;
    struct ggn_window *list; /* owns; ordered by series, then by level */
    int *first;              /* [n_series + 1] */
};

struct ggn_window_options {
    enum ggn_split split;
    int length;      /* S */
    int synthetic;   /* with the synthetic series */
    int label_first; /* the label belongs to the first image (the published fault) instead of the last */
    int soft;        /* labels between 0 and 1 near the threshold, as wide as the labels' spread says */
};

int ggn_windows_create(struct ggn_windows *windows, const struct ggn_series_set *set,
                       const struct ggn_window_options *options, struct base_err *err);
void ggn_windows_release(struct ggn_windows *windows);

/* Window for sample i of step s: scenes equally often, then blocks, then noisy and not noisy, then levels near the threshold
 * more often than far ones. */
int ggn_windows_draw(const struct ggn_windows *windows, uint64_t step, int i, uint32_t seed);

/* What is done to all images of a sample alike. */
struct ggn_augment {
    int flip_x, flip_y, transpose; /* transpose for square blocks only */
    float gain[3];                 /* linear light */
    int blind;                     /* the noise map is left out, as of a host without half buffers */
};
struct ggn_augment ggn_augment_none(void);
struct ggn_augment_options {
    int flips;  /* flips and rotations */
    int square; /* the images are */
    /* exposure up to ±jitter/2 octaves, white balance up to ±jitter/8: little enough for the label to hold */
    double jitter;
    double noise_map; /* share of samples that keep their noise map */
};
struct ggn_augment ggn_augment_draw(uint64_t step, int i, uint32_t seed, const struct ggn_augment_options *options);

/* The input planes of M for one window, gap-free [3·S][H][W] in 0..1. `difference` > 0: the images before the last one hold
 * difference · (image − last) instead, see ggn_train_fold. */
void ggn_window_planes(const struct ggn_level_series *series, int last, int length, int width, int height, int denoised,
                       const struct ggn_augment *augment, float difference, float *planes);

/* The noise map of level `last` as D takes it, gap-free [H][W]; 0: the sample has none. The gain is taken as one of all
 * channels, on a curve of power 1/2.4. */
int ggn_noise_map_plane(const struct ggn_level_series *series, int last, int width, int height,
                        const struct ggn_augment *augment, float *plane);

/* A crop for the denoiser: image `level` of the series and its reference, [3][size][size] each. */
void ggn_crop_planes(const struct ggn_level_series *series, int level, int width, int height, int x0, int y0, int crop_w,
                     int crop_h, const struct ggn_augment *augment, float *noisy, float *reference);

#endif
