/*
 * Labels: from how many samples per pixel on a block's noise is not seen. DIR/labels.json, written by `ggn label` and the
 * import.
 *
 * A threshold at the cap is censored: noise was (or may have been) visible up to there, and nothing is known beyond.
 */
#ifndef GGN_DATA_LABELS_H
#define GGN_DATA_LABELS_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum { GGN_LABELS_TEXT = 512 };

struct ggn_label {
    uint32_t id;      /* the block */
    double threshold; /* spp */
    int censored;
};

struct ggn_labels {
    char source[16];              /* "human" or "observer": a model observer is never called human */
    char detail[GGN_LABELS_TEXT]; /* for people: which file, which parameters */
    double cap;                   /* spp */
    double spread;                /* octaves: standard deviation of the psychometric curve, for soft labels; > 0 */
    uint32_t n;
    struct ggn_label *labels; /* owns */
};

/* GGN_LABELS_SPREAD octaves: labels average about three people, errors below +-0.25 octave are noise. */
#define GGN_LABELS_SPREAD 0.25

int ggn_labels_parse(const char *path, const char *text, size_t size, struct ggn_labels *labels, struct base_err *err);
int ggn_labels_read(const char *dir, struct ggn_labels *labels, struct base_err *err);
/* BASE_EINVAL when DIR has thresholds of people that are not those of `next` (NULL: an observer's), or labels that cannot be
 * read. */
int ggn_labels_keep_people(const char *dir, const struct ggn_labels *next, struct base_err *err);
/* Without replace_human it fails where ggn_labels_keep_people does. */
int ggn_labels_write(const char *dir, const struct ggn_labels *labels, int replace_human, struct base_err *err);
void ggn_labels_release(struct ggn_labels *labels);
/* NULL if the block has none. */
const struct ggn_label *ggn_labels_find(const struct ggn_labels *labels, uint32_t id);

/* Hard label: 1 noisy, 0 not, -1 unknown (a censored block at or above its threshold). */
int ggn_label_noisy(const struct ggn_label *label, double spp);
/* Probability that a viewer still sees noise: normal distribution in log2 spp around the threshold. NaN when unknown. */
double ggn_label_p_noisy(const struct ggn_label *label, double spp, double spread);

#endif
