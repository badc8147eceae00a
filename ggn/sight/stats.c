#include "sight/stats.h"

#include <math.h>
#include <stdlib.h>

double ggn_stats_mean(const double *x, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++)
        sum += x[i];
    return n > 0 ? sum / (double)n : (double)NAN;
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void ggn_stats_sort(double *x, size_t n) { qsort(x, n, sizeof *x, compare_doubles); }

double ggn_stats_quantile(double *x, size_t n, double q)
{
    if (n == 0)
        return (double)NAN;
    ggn_stats_sort(x, n);
    double at = q * (double)(n - 1);
    size_t i = (size_t)at;
    if (i + 1 >= n)
        return x[n - 1];
    return x[i] + (at - (double)i) * (x[i + 1] - x[i]);
}

static double pearson(const double *x, const double *y, size_t n)
{
    double mx = ggn_stats_mean(x, n), my = ggn_stats_mean(y, n), xy = 0.0, xx = 0.0, yy = 0.0;
    for (size_t i = 0; i < n; i++) {
        xy += (x[i] - mx) * (y[i] - my);
        xx += (x[i] - mx) * (x[i] - mx);
        yy += (y[i] - my) * (y[i] - my);
    }
    return xx > 0.0 && yy > 0.0 ? xy / sqrt(xx * yy) : (double)NAN;
}

struct keyed {
    double key; /* first: compare_doubles looks at it */
    size_t index;
};

/* rank[i] in 1..n; equal values share the mean of their ranks. */
static int ranks(const double *x, size_t n, double *rank, struct base_err *err)
{
    struct keyed *k = malloc((n > 0 ? n : 1) * sizeof *k);
    if (!k)
        return base_fail_nomem(err, "ranks");
    for (size_t i = 0; i < n; i++)
        k[i] = (struct keyed){x[i], i};
    qsort(k, n, sizeof *k, compare_doubles);
    for (size_t i = 0, j; i < n; i = j) {
        for (j = i + 1; j < n && k[j].key == k[i].key;)
            j++;
        for (size_t m = i; m < j; m++)
            rank[k[m].index] = 0.5 * (double)(i + j + 1);
    }
    free(k);
    return 0;
}

int ggn_stats_spearman(const double *x, const double *y, size_t n, double *rho, struct base_err *err)
{
    double *r = malloc((n > 0 ? 2 * n : 1) * sizeof *r);
    if (!r)
        return base_fail_nomem(err, "ranks");
    int rc = ranks(x, n, r, err);
    if (!rc)
        rc = ranks(y, n, r + n, err);
    if (!rc)
        *rho = pearson(r, r + n, n);
    free(r);
    return rc;
}

int ggn_stats_auc(const double *score, const unsigned char *label, size_t n, double *auc, struct base_err *err)
{
    double *rank = malloc((n > 0 ? n : 1) * sizeof *rank), sum = 0.0;
    size_t positive = 0;
    if (!rank)
        return base_fail_nomem(err, "ranks");
    int rc = ranks(score, n, rank, err);
    for (size_t i = 0; i < n && !rc; i++)
        if (label[i]) {
            sum += rank[i];
            positive++;
        }
    free(rank);
    if (rc)
        return rc;
    double p = (double)positive, q = (double)(n - positive);
    *auc = p > 0.0 && q > 0.0 ? (sum - 0.5 * p * (p + 1.0)) / (p * q) : (double)NAN;
    return 0;
}
