/*
 * A published model before the network, trained: its features of an image, its weights, and how its answer stops a block.
 * Evaluation (baselines/learned.h) and the criteria of the same names (plugin/baseline.c) both use it.
 *
 * The features of an image are numbers: of the block's own pixels where it has the size the baseline was trained on, else of
 * tiles of that size (model/window.h), of which the noisiest counts. The SVMs use the newest image alone, the LSTM a window.
 * Stored as a .ggn file (model/container.h) of "kind": "baseline".
 *
 * A baseline is read-only once made: any number of threads and readers. A reader is one worker's scratch; after create it
 * allocates nothing.
 */
#ifndef GGN_BASELINES_BASELINE_H
#define GGN_BASELINES_BASELINE_H

#include "baselines/svm.h"
#include "model/container.h"
#include "model/policy.h"

enum ggn_baseline_kind {
    GGN_SVD_ENTROPY,    /* SVD-entropy + LSTM (Buisine et al. 2021) */
    GGN_ATTRIBUTES_SVM, /* 26 attributes + SVM (Constantin et al. 2015) */
    GGN_MASK_SVM,       /* noise mask + SVM (Takouachet et al. 2017) */
    GGN_BASELINES
};
extern const char *const ggn_baseline_names[GGN_BASELINES + 1]; /* "svd-entropy", "attributes", "noise-mask", NULL */
extern const char *const ggn_baseline_titles[GGN_BASELINES];    /* for tables */

struct ggn_baseline {
    enum ggn_baseline_kind kind;
    int width, height; /* of a tile */
    int window;        /* images it judges together; 1 for the SVMs */
    int first;         /* SVD-entropy: number of the first singular value, 0 or 5 */
    int features;      /* numbers per tile and image */
    struct ggn_policy policy;
    float *lstm;        /* owns; [ggn_lstm_parameters(features)]; NULL: not trained, or an SVM */
    struct ggn_svm svm; /* empty: not trained, or an LSTM */
};

/* An untrained one, to judge blocks of width x height. BASE_EINVAL: they are too small, or windows of other than 1 to
 * GGN_WINDOW_MAX images. */
int ggn_baseline_init(struct ggn_baseline *b, enum ggn_baseline_kind kind, int width, int height, int window,
                      struct base_err *err);
void ggn_baseline_release(struct ggn_baseline *b);

/* Atomic. provenance: where it comes from, one JSON object; borrowed. */
int ggn_baseline_save(const struct ggn_baseline *b, const char *path, enum ggn_type type, const struct cJSON *provenance,
                      struct base_err *err);
/* kind: the one that is expected, GGN_BASELINES: any. BASE_EINVAL with one line that names the file for anything that is no
 * such baseline. On failure *b is empty. */
int ggn_baseline_load(struct ggn_baseline *b, const char *path, enum ggn_baseline_kind kind, struct base_err *err);
/* The same of a file that was read already; `name` is for messages. */
int ggn_baseline_parse(struct ggn_baseline *b, const struct ggn_container *c, const char *name, enum ggn_baseline_kind kind,
                       struct base_err *err);

/* Features of one image of width x height: tiles times b->features. */
size_t ggn_baseline_feature_count(const struct ggn_baseline *b, int width, int height);

struct ggn_baseline_reader;
/* NULL on failure. Borrows the baseline. An untrained one's reader extracts features only. */
struct ggn_baseline_reader *ggn_baseline_reader_create(const struct ggn_baseline *b, struct base_err *err);
void ggn_baseline_reader_destroy(struct ggn_baseline_reader *reader);
/* rgb: [3][height][width] display codes. features: [ggn_baseline_feature_count]; NaN where there are none. */
void ggn_baseline_extract(struct ggn_baseline_reader *reader, const uint8_t *rgb, int width, int height, double *features);
/* features: of b->window images of width x height, noisiest first. Logit of "still noisy", before the policy's
 * calibration; NaN if a feature is NaN. */
double ggn_baseline_logit(struct ggn_baseline_reader *reader, const double *const *features, int width, int height);

#endif
