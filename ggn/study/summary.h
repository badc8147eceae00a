/*
 * What all people together gave: a threshold per block, how well people agree, shares of judgements, and how many people it
 * takes. Only people who count (people.h) enter.
 */
#ifndef GGN_STUDY_SUMMARY_H
#define GGN_STUDY_SUMMARY_H

#include "study/people.h"

struct ggn_study_threshold { /* of a cell, octaves; NaN without people */
    double t, lo, hi; /* mean over people of their estimates, none beyond the highest level; 95 %: Student's t over people,
                         or with one person their own interval */
    double spread;    /* geometric mean of theirs */
    int people, trials;
    int at_cap; /* so many did not reach their threshold at the highest level */
};

/* out: [n_cells] */
void ggn_study_thresholds(const struct ggn_study_people *people, struct ggn_study_threshold *out);

/* How many octaves of samples more one kind takes than the noisy picture of the same block and scene: each person's mean
 * over the blocks of which they have both, then the mean over people with Student's interval (NaN below two). cell -1: all
 * blocks of the kind, else the one that is said. */
struct ggn_study_difference {
    double octaves, lo, hi;
    int people, blocks;
};
struct ggn_study_difference ggn_study_against_noisy(const struct ggn_study_people *people, enum ggn_study_kind kind,
                                                    int cell);

/* Agreement of people over blocks, in log2 of the thresholds. Each person against the mean of the others says how well the
 * best possible prediction could do on one person (lower bound of the noise ceiling); against the mean with them in it is
 * the upper bound (Nili et al. 2014). Means over people; NaN below two people or three blocks. */
struct ggn_study_ceiling {
    int people, blocks; /* blocks that at least two people have */
    double pearson_lower, pearson_upper, spearman_lower, spearman_upper;
    double median_abs_log2_lower, median_abs_log2_upper;
    double within_half_lower, within_one_lower; /* share of blocks within half an octave, an octave */
};
int ggn_study_ceiling(const struct ggn_study_people *people, struct ggn_study_ceiling *out, struct base_err *err);

/* Share of "same". view, condition: -1 pools. */
struct ggn_study_share {
    int same, n;
    double share, lo, hi; /* Wilson, 95 %; NaN for n = 0 */
    double rating;        /* mean */
};
struct ggn_study_share ggn_study_share(const struct ggn_study_people *people, int view, int condition);

/* People needed to show that two conditions differ by `difference` of share (two-sided 5 %, power 80 %), when one has the
 * share p and each person judges m pictures of each condition:
 *     n = (z.975 + z.80)^2 (p q + p' q') / difference^2 · (1 + (m - 1) icc) / m */
int ggn_study_people_needed(double p, double difference, int m, double icc);
/* Intraclass correlation of the judgements of one condition within people (one-way analysis of variance, not below 0); NaN
 * below two people or two judgements each. */
double ggn_study_icc(const struct ggn_study_people *people, int condition);

#endif
