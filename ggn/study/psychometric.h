/*
 * The psychometric curves of one person from two-interval forced choices, one per block, and small-sample intervals.
 *
 * x = log2 of the samples per pixel. Without bias and lapses P(correct | x) = 1/2 + 1/2 Phi((t - x)/s): three in four are
 * correct at the threshold t, s is the spread in octaves. As in signal detection theory that is Phi(d(x)), d being what
 * separates the intervals; a bias b for one interval makes it Phi(d + b) when the noise comes first and Phi(d - b) when it
 * comes second (Green & Swets 1966; Yeshurun, Carrasco, Maloney 2008), and with probability `lapse` the answer is a guess.
 *
 * Lapse and bias belong to the person, the spread to the block but not far from the person's own, t to the block alone. The
 * joint posterior is taken over a grid: t uniform from two octaves below the lowest level to two above the highest, the
 * others with the priors in psychometric.c. So every block helps to know the person, and what is not known of the person
 * widens the intervals.
 */
#ifndef GGN_STUDY_PSYCHOMETRIC_H
#define GGN_STUDY_PSYCHOMETRIC_H

#include "base/err.h"

/* The x of a catch trial: so far below any threshold that only a lapse answers wrong. */
#define GGN_STUDY_PLAIN (-1000.0)

struct ggn_study_choice {
    double x;  /* octaves */
    int first; /* the noise was in the first interval */
    int correct;
};

struct ggn_study_estimate { /* octaves; NaN where nothing is known */
    int trials;
    double t, lo, hi, se;                /* posterior median, central 95 %, standard deviation */
    double spread, spread_lo, spread_hi; /* the same of s */
};

struct ggn_study_curve {                    /* one block: what was chosen, and what follows */
    const struct ggn_study_choice *choices; /* borrowed; [n], n >= 1 */
    int n;
    double x_min, x_max; /* lowest and highest level, octaves */
    struct ggn_study_estimate estimate;
};

/* Fills the estimates of all blocks of one person. At most 1000 choices per block. BASE_ENOMEM only. */
int ggn_study_psychometric(struct ggn_study_curve *curves, int n_curves, struct base_err *err);
/* P(correct) at x without bias and lapses. */
double ggn_study_p_correct(double x, double t, double spread);

/* The normal distribution function and its inverse (p in (0, 1)). */
double ggn_study_normal(double z);
double ggn_study_normal_quantile(double p);
/* The 97.5 % quantile of Student's t, df >= 1. */
double ggn_study_t975(int df);
/* Wilson's score interval, 95 %, for k of n (Wilson 1927). */
void ggn_study_wilson(int k, int n, double *lo, double *hi);

#endif
