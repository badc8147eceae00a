/*
 * The model observer: stands in for people where there are no human thresholds, and is never called human.
 *
 * A map of visible difference between the display image at n spp and the converged image, weakened where the picture itself
 * is busy (contrast masking), pooled over the block by a high percentile; noisy iff the pooled value exceeds tau; the threshold
 * is the smallest sample count from which it stays below. Pure functions, thread-safe.
 */
#ifndef GGN_OBSERVER_OBSERVER_H
#define GGN_OBSERVER_OBSERVER_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "data/sequence.h"

enum ggn_observer_map {
    GGN_MAP_FLIP,     /* LDR-FLIP at 67.02 pixels per degree */
    GGN_MAP_LIGHTNESS /* |Gaussian blur of the difference of L*| */
};

struct ggn_observer {
    enum ggn_observer_map map;
    double blur_px;    /* sigma of the blur, GGN_MAP_LIGHTNESS only */
    double masking;    /* k: the error is divided by 1 + k * local standard deviation of the converged L* */
    int window_px;     /* odd side of the box over which that deviation is taken */
    double percentile; /* in (0, 100] */
    double tau;
    double spread;     /* octaves, for soft labels */
};

/* What is used when no other is named: calibrated as its card says (ggn/observer/observer.json holds the same). */
extern const struct ggn_observer ggn_observer_default;

/* Parameters from and to a JSON file. calibration (may be NULL): a JSON object text that is kept in the file as is. */
int ggn_observer_read(const char *path, struct ggn_observer *observer, struct base_err *err);
int ggn_observer_write(const char *path, const struct ggn_observer *observer, const char *calibration, struct base_err *err);
/* One line for people and for the card. */
void ggn_observer_describe(const struct ggn_observer *observer, char *text, size_t room);

/* reference, test: [h][w][3] sRGB 8 bit. map: [h][w], without masking. */
int ggn_observer_error_map(enum ggn_observer_map kind, double blur_px, const uint8_t *reference, const uint8_t *test, int w, int h,
                           float *map, struct base_err *err);
/* Local standard deviation of L* in a box of side window_px (odd); borders repeat. deviation: [h][w]. */
int ggn_observer_deviation(const uint8_t *reference, int w, int h, int window_px, float *deviation, struct base_err *err);
/* The percentile of map / (1 + masking * deviation). scratch: [n]. */
double ggn_observer_pool(const float *map, const float *deviation, size_t n, double masking, double percentile, float *scratch);

/* Visibility against spp of one block. */
struct ggn_curve {
    int n;
    double *spp, *score; /* own; spp rising */
};
void ggn_curve_release(struct ggn_curve *c);

/* What stands for the image at n spp. */
enum ggn_observer_source {
    GGN_SOURCE_RENDERED, /* the recorded levels */
    GGN_SOURCE_HALVES,   /* reference (or mean) + sqrt(spp0/n) * half-buffer difference of the full level at spp0 */
    GGN_SOURCE_AUTO      /* the recorded levels, and beyond the last one the halves, where the block has what that takes; halves alone
                            where there is no reference */
};

/*
 * Display images to judge: the converged one, and the one at any of `n` sample counts: the recorded levels, or for GGN_SOURCE_HALVES
 * 20, 23, … 10,000 spp (each 1.15 times the one before), whatever was recorded, or for GGN_SOURCE_AUTO the former and then those of the
 * latter that lie beyond.
 *
 * A reference of n_r independent samples has noise of its own: I_n - R has the variance s^2 (1/n + 1/n_r), not s^2/n. Scaling that
 * linear difference by sqrt(n_r/(n_r + n)) gives it the variance that I_n has against a perfect reference, so that R may stand for
 * the converged image even for n > n_r. Without linear data, or when the reference is not independent, images are taken as they are.
 * Halves without a reference take the mean of the full level for the converged image; then its noise, known from D, is taken out of
 * the local deviation that masks.
 */
struct ggn_stimuli {
    const struct ggn_seq_block *block; /* borrows */
    int recorded;                      /* the first so many are recorded levels, the others simulated */
    int scale;                         /* whether the difference is scaled */
    int noisy_base;                    /* the converged image is a mean with the noise `difference` */
    double spp0;                       /* of D */
    int n;
    double *spp;                       /* owns; [n]; rising */
    float *base, *difference, *work;   /* own; [3][P]; linear */
    uint8_t *converged;                /* owns; [P][3] */
};
int ggn_stimuli_init(struct ggn_stimuli *s, const struct ggn_seq_block *block, enum ggn_observer_source source,
                     int reference_independent, struct base_err *err);
void ggn_stimuli_release(struct ggn_stimuli *s);
/* test: [P][3], the picture at spp[i]. */
int ggn_stimuli_make(struct ggn_stimuli *s, int i, uint8_t *test, struct base_err *err);
/* Local deviation of the converged image, [P], without its noise where that is known. */
int ggn_stimuli_deviation(struct ggn_stimuli *s, int window_px, float *deviation, struct base_err *err);

/* Whether GGN_SOURCE_AUTO goes beyond the last level of this block. */
int ggn_stimuli_extend(const struct ggn_seq_block *block, int reference_independent);
/* The last sample count that is simulated. */
enum { GGN_SIMULATED_CAP = 10000 };

/* The curve of one block as the observer sees it. */
int ggn_observer_curve(const struct ggn_observer *o, const struct ggn_seq_block *block, enum ggn_observer_source source,
                       int reference_independent, struct ggn_curve *curve, struct base_err *err);

/* Smallest spp from which the score stays at or below tau, interpolated between levels in log-log. censored: still above at the last
 * level, which is then returned. A curve that starts below gives its first level. */
double ggn_curve_threshold(const struct ggn_curve *c, double tau, int *censored);
/* The score at spp, interpolated in log-log and clamped to the ends. */
double ggn_curve_at(const struct ggn_curve *c, double spp);

#endif
