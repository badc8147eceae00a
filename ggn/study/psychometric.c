#include "study/psychometric.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Steps of 1/12 octave are a small part of any standard error that 30 trials reach. The priors: spreads around half an
 * octave as in the published raw trials, a block's with the person's or one step from it; lapses mostly below a tenth;
 * biases mostly below half of a d' of 1. Habits are pairs of bias and lapse. */
enum { STEPS_PER_OCTAVE = 12, MARGIN = 2, N_SPREADS = 7, N_LAPSES = 4, N_BIASES = 5, N_HABITS = N_LAPSES * N_BIASES };
static const double spreads[N_SPREADS] = {0.15, 0.22, 0.33, 0.5, 0.75, 1.1, 1.6};
static const double spread_prior[N_SPREADS] = {0.05, 0.1, 0.2, 0.3, 0.2, 0.1, 0.05};
static const double lapses[N_LAPSES] = {0.0, 0.03, 0.08, 0.2};
static const double lapse_prior[N_LAPSES] = {0.4, 0.4, 0.15, 0.05};
static const double biases[N_BIASES] = {-0.8, -0.4, 0.0, 0.4, 0.8};
static const double bias_prior[N_BIASES] = {0.06, 0.24, 0.4, 0.24, 0.06};
static const double own_spread = 0.8; /* that a block's spread is the person's; the rest on its neighbours */

/* Of a block's spread b given the person's p. */
static double spread_given(int b, int p)
{
    int neighbours = (p > 0) + (p + 1 < N_SPREADS);
    return b == p ? own_spread : b == p - 1 || b == p + 1 ? (1.0 - own_spread) / neighbours : 0.0;
}

double ggn_study_normal(double z) { return 0.5 * erfc(-z * 0.70710678118654752440); }

/* By halving; tails beyond 1e-15 do not matter here. */
double ggn_study_normal_quantile(double p)
{
    p = fmin(fmax(p, 1e-15), 1.0 - 1e-15);
    double lo = -8.0, hi = 8.0;
    for (int i = 0; i < 60; i++) {
        double mid = 0.5 * (lo + hi);
        if (ggn_study_normal(mid) < p)
            lo = mid;
        else
            hi = mid;
    }
    return 0.5 * (lo + hi);
}

double ggn_study_p_correct(double x, double t, double spread) { return 0.5 + 0.5 * ggn_study_normal((t - x) / spread); }

double ggn_study_t975(int df)
{
    static const double table[30] = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281,
                                     2.2010,  2.1788, 2.1604, 2.1448, 2.1314, 2.1199, 2.1098, 2.1009, 2.0930, 2.0860,
                                     2.0796,  2.0739, 2.0687, 2.0639, 2.0595, 2.0555, 2.0518, 2.0484, 2.0452, 2.0423};
    const double z = 1.959963984540054;
    return df <= 30 ? table[df - 1] : z + (z * z * z + z) / (4.0 * df); /* Abramowitz & Stegun 26.7.5, first terms */
}

void ggn_study_wilson(int k, int n, double *lo, double *hi)
{
    const double z = 1.959963984540054;
    double p = (double)k / n, d = 1.0 + z * z / n, c = (p + z * z / (2.0 * n)) / d;
    double h = z * sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n)) / d;
    *lo = k == 0 ? 0.0 : c - h;
    *hi = k == n ? 1.0 : c + h;
}

/* d against z = (t - x)/s: tabulated once, since its inverse of the normal distribution is dear. */
enum { D_RANGE = 8, D_PER_UNIT = 64, N_D = 2 * D_RANGE * D_PER_UNIT + 1 };

static void fill_d(double d[N_D])
{
    for (int i = 0; i < N_D; i++)
        d[i] = ggn_study_normal_quantile(0.5 + 0.5 * ggn_study_normal((double)i / D_PER_UNIT - D_RANGE));
}

static double separation(const double d[N_D], double z)
{
    double at = fmin(fmax((z + D_RANGE) * D_PER_UNIT, 0.0), N_D - 1.0);
    int i = at < N_D - 1 ? (int)at : N_D - 2;
    return d[i] + (at - i) * (d[i + 1] - d[i]);
}

/* Nothing is impossible: a finger slips. */
#define RAREST 1e-9

/* Multiplies the likelihoods of one cell (t, s) for every habit by that of one choice. */
static void multiply(double *cell, double d, const struct ggn_study_choice *c)
{
    for (int b = 0; b < N_BIASES; b++) {
        double p = ggn_study_normal(c->first ? d + biases[b] : d - biases[b]);
        for (int l = 0; l < N_LAPSES; l++) {
            double correct = fmin(0.5 * lapses[l] + (1.0 - lapses[l]) * p, 1.0 - RAREST);
            cell[b * N_LAPSES + l] *= c->correct ? correct : 1.0 - correct;
        }
    }
}

/* Quantile of a distribution given by weights of equal cells around x0 + i·step, linear within a cell. */
static double quantile(const double *w, int n, double x0, double step, double q)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        if (sum + w[i] >= q)
            return x0 + step * (i - 0.5 + (q - sum) / w[i]);
        sum += w[i];
    }
    return x0 + step * (n - 0.5);
}

/* The same over the few spreads, in log2. */
static double spread_quantile(const double w[N_SPREADS], double q)
{
    double sum = 0.0;
    for (int i = 0; i < N_SPREADS; i++) {
        double below =
            log2(i > 0 ? sqrt(spreads[i - 1] * spreads[i]) : spreads[0] * spreads[0] / sqrt(spreads[0] * spreads[1]));
        double above = log2(i + 1 < N_SPREADS ? sqrt(spreads[i] * spreads[i + 1])
                                              : spreads[i] * spreads[i] / sqrt(spreads[i - 1] * spreads[i]));
        if (sum + w[i] >= q)
            return exp2(below + (above - below) * (q - sum) / w[i]);
        sum += w[i];
    }
    return spreads[N_SPREADS - 1];
}

struct person {
    double d[N_D];
    double posterior[N_SPREADS][N_HABITS]; /* of the person's spread and habits; logarithms while it is summed */
};

/* likelihood[s][h] of the block at threshold t. */
static void cells(const struct person *p, const struct ggn_study_curve *c, double t, double likelihood[N_SPREADS][N_HABITS])
{
    for (int s = 0; s < N_SPREADS; s++) {
        for (int h = 0; h < N_HABITS; h++)
            likelihood[s][h] = 1.0;
        for (int i = 0; i < c->n; i++)
            multiply(likelihood[s], separation(p->d, (t - c->choices[i].x) / spreads[s]), &c->choices[i]);
    }
}

static int steps(const struct ggn_study_curve *c)
{
    return (int)ceil((c->x_max - c->x_min + 2 * MARGIN) * STEPS_PER_OCTAVE) + 1;
}

static double step_t(const struct ggn_study_curve *c, int i) { return c->x_min - MARGIN + (double)i / STEPS_PER_OCTAVE; }

/* log of the block's evidence, sum over t and over its own spread, for each spread and habit of the person; to or from what
 * is known. */
static void add_evidence(struct person *p, const struct ggn_study_curve *c, double evidence[N_SPREADS][N_HABITS])
{
    double likelihood[N_SPREADS][N_HABITS], sum[N_SPREADS][N_HABITS] = {{0}};
    for (int i = 0; i < steps(c); i++) {
        cells(p, c, step_t(c, i), likelihood);
        for (int s = 0; s < N_SPREADS; s++)
            for (int h = 0; h < N_HABITS; h++)
                sum[s][h] += likelihood[s][h];
    }
    for (int s = 0; s < N_SPREADS; s++)
        for (int h = 0; h < N_HABITS; h++) {
            double e = 0.0;
            for (int b = 0; b < N_SPREADS; b++)
                e += spread_given(b, s) * sum[b][h];
            evidence[s][h] = log(fmax(e, DBL_MIN)); /* what underflowed is out of the question anyway */
            p->posterior[s][h] += evidence[s][h];
        }
}

/* Weights of the block's own spread and the habits that everything but the block tells: posterior less the block's evidence.
 */
static void weights(const struct person *p, const double evidence[N_SPREADS][N_HABITS], double w[N_SPREADS][N_HABITS])
{
    double most = -HUGE_VAL;
    for (int s = 0; s < N_SPREADS; s++)
        for (int h = 0; h < N_HABITS; h++)
            most = fmax(most, p->posterior[s][h] - evidence[s][h]);
    for (int b = 0; b < N_SPREADS; b++)
        for (int h = 0; h < N_HABITS; h++) {
            w[b][h] = 0.0;
            for (int s = 0; s < N_SPREADS; s++)
                w[b][h] += spread_given(b, s) * exp(p->posterior[s][h] - evidence[s][h] - most);
        }
}

static void estimate(const struct person *p, struct ggn_study_curve *c, const double w[N_SPREADS][N_HABITS], double *of_t)
{
    double likelihood[N_SPREADS][N_HABITS], of_s[N_SPREADS] = {0}, sum = 0.0, mean = 0.0, var = 0.0;
    int n = steps(c);
    for (int i = 0; i < n; i++) {
        cells(p, c, step_t(c, i), likelihood);
        of_t[i] = 0.0;
        for (int s = 0; s < N_SPREADS; s++)
            for (int h = 0; h < N_HABITS; h++) {
                of_t[i] += w[s][h] * likelihood[s][h];
                of_s[s] += w[s][h] * likelihood[s][h];
            }
        sum += of_t[i];
    }
    for (int i = 0; i < n; i++) {
        of_t[i] /= sum;
        mean += of_t[i] * step_t(c, i);
    }
    for (int i = 0; i < n; i++)
        var += of_t[i] * pow(step_t(c, i) - mean, 2.0);
    for (int s = 0; s < N_SPREADS; s++)
        of_s[s] /= sum;
    double first = step_t(c, 0), step = 1.0 / STEPS_PER_OCTAVE;
    c->estimate = (struct ggn_study_estimate){.trials = c->n,
                                              .t = quantile(of_t, n, first, step, 0.5),
                                              .lo = quantile(of_t, n, first, step, 0.025),
                                              .hi = quantile(of_t, n, first, step, 0.975),
                                              .se = sqrt(var),
                                              .spread = spread_quantile(of_s, 0.5),
                                              .spread_lo = spread_quantile(of_s, 0.025),
                                              .spread_hi = spread_quantile(of_s, 0.975)};
}

int ggn_study_psychometric(struct ggn_study_curve *curves, int n_curves, struct base_err *err)
{
    int longest = 0, rc = 0;
    for (int i = 0; i < n_curves; i++)
        longest = steps(&curves[i]) > longest ? steps(&curves[i]) : longest;
    struct person *p = malloc(sizeof *p);
    double(*evidence)[N_SPREADS][N_HABITS] = malloc((size_t)(n_curves + 1) * sizeof *evidence), w[N_SPREADS][N_HABITS];
    double *of_t = malloc((size_t)(longest + 1) * sizeof *of_t);
    if (!p || !evidence || !of_t) {
        rc = base_fail_nomem(err, "psychometric curves");
        goto out;
    }
    fill_d(p->d);
    for (int s = 0; s < N_SPREADS; s++)
        for (int h = 0; h < N_HABITS; h++)
            p->posterior[s][h] = log(spread_prior[s] * bias_prior[h / N_LAPSES] * lapse_prior[h % N_LAPSES]);
    for (int i = 0; i < n_curves; i++)
        add_evidence(p, &curves[i], evidence[i]);
    for (int i = 0; i < n_curves; i++) {
        weights(p, (const double(*)[N_HABITS])evidence[i], w);
        estimate(p, &curves[i], (const double(*)[N_HABITS])w, of_t);
    }
out:
    free(of_t);
    free(evidence);
    free(p);
    return rc;
}
