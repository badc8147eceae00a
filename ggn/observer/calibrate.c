#include "observer/calibrate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "figures/stats.h"

/* The forms that are tried: every map with every masking and percentile. */
static const struct {
    enum ggn_observer_map map;
    double blur_px;
} maps[] = {{GGN_MAP_FLIP, 0.0}, {GGN_MAP_LIGHTNESS, 0.7}, {GGN_MAP_LIGHTNESS, 1.0}, {GGN_MAP_LIGHTNESS, 1.2}};
static const struct {
    double k;
    int window_px;
} maskings[] = {{0.0, 5}, {0.1, 3}, {0.1, 5}, {0.1, 9}, {0.2, 3}, {0.2, 5}, {0.2, 9}, {0.3, 3}, {0.3, 5}, {0.3, 9}};
static const double percentiles[] = {95.0, 99.0};
enum { MAPS = 4, MASKINGS = 10, PERCENTILES = 2, FORMS = MAPS * MASKINGS * PERCENTILES };

static int form_index(int map, int masking, int percentile)
{
    return (map * MASKINGS + masking) * PERCENTILES + percentile;
}

struct job {
    const struct ggn_calibration_block *blocks;
    enum ggn_observer_source source;
    struct ggn_curve *curves; /* [n][FORMS]; spp and score own */
    int *rc;                  /* [n] */
    struct base_err *errs;     /* [n] */
};

static void pool_level(struct ggn_curve *curves, int level, const float *map, int map_index, const float *deviations, size_t n, float *scratch)
{
    for (int m = 0; m < MASKINGS; m++)
        for (int p = 0; p < PERCENTILES; p++)
            curves[form_index(map_index, m, p)].score[level] =
                ggn_observer_pool(map, deviations + (size_t)m * n, n, maskings[m].k, percentiles[p], scratch);
}

static int block_curves(const struct ggn_calibration_block *b, enum ggn_observer_source source, struct ggn_curve *curves, struct base_err *err)
{
    const struct ggn_seq_block *block = b->block;
    int w = (int)block->width, h = (int)block->height;
    size_t n = (size_t)w * (size_t)h;
    struct ggn_stimuli s;
    int rc = ggn_stimuli_init(&s, block, source, b->reference_independent, err);
    if (rc)
        return rc;
    float *planes = malloc((MASKINGS + 2) * n * sizeof *planes);
    uint8_t *test = malloc(3 * n);
    if (!planes || !test)
        rc = base_fail_nomem(err, "calibration");
    float *map = planes + MASKINGS * n, *scratch = map + n;
    for (int m = 0; m < MASKINGS && !rc; m++)
        rc = ggn_stimuli_deviation(&s, maskings[m].window_px, planes + (size_t)m * n, err);
    for (int f = 0; f < FORMS && !rc; f++) {
        curves[f] = (struct ggn_curve){.n = s.n, .spp = malloc((size_t)s.n * sizeof(double)), .score = malloc((size_t)s.n * sizeof(double))};
        if (!curves[f].spp || !curves[f].score)
            rc = base_fail_nomem(err, "calibration");
        for (int i = 0; i < s.n && !rc; i++)
            curves[f].spp[i] = s.spp[i];
    }
    for (int i = 0; i < s.n && !rc; i++) {
        rc = ggn_stimuli_make(&s, i, test, err);
        for (int k = 0; k < MAPS && !rc; k++) {
            rc = ggn_observer_error_map(maps[k].map, maps[k].blur_px, s.converged, test, w, h, map, err);
            if (!rc)
                pool_level(curves, i, map, k, planes, n, scratch);
        }
    }
    free(test);
    free(planes);
    ggn_stimuli_release(&s);
    return rc;
}

static void run_block(void *data, long i, int worker)
{
    struct job *job = data;
    (void)worker;
    job->rc[i] = block_curves(&job->blocks[i], job->source, job->curves + i * FORMS, &job->errs[i]);
}

/* Geometric median of the scores at the human thresholds, block `skip` (or -1) left out. scratch: [n]. */
static double fit_tau(const struct ggn_curve *curves, const struct ggn_calibration_block *blocks, int n, int form, int skip, double *scratch)
{
    size_t count = 0;
    for (int i = 0; i < n; i++)
        if (i != skip)
            scratch[count++] = log(fmax(ggn_curve_at(&curves[i * FORMS + form], blocks[i].human), 1e-12));
    return exp(ggn_stats_quantile(scratch, count, 0.5));
}

static double predict(const struct ggn_curve *curves, int i, int form, double tau)
{
    int censored;
    return ggn_curve_threshold(&curves[i * FORMS + form], tau, &censored);
}

/* Mean |log2| over the blocks other than `skip`, each predicted with the tau of the rest. */
static double loo_error(const struct ggn_curve *curves, const struct ggn_calibration_block *blocks, int n, int form, int skip, double *errors,
                        double *scratch)
{
    size_t count = 0;
    for (int i = 0; i < n; i++) {
        if (i == skip)
            continue;
        /* With a block skipped, tau is fitted to all others: leaving out two at a time changes a median very little. */
        double tau = fit_tau(curves, blocks, n, form, i, scratch);
        errors[count++] = fabs(log2(predict(curves, i, form, tau) / blocks[i].human));
    }
    return ggn_stats_mean(errors, count);
}

static int best_form(const struct ggn_curve *curves, const struct ggn_calibration_block *blocks, int n, int skip, double *errors, double *scratch)
{
    int best = 0;
    double least = INFINITY;
    for (int f = 0; f < FORMS; f++) {
        double e = loo_error(curves, blocks, n, f, skip, errors, scratch);
        if (e < least) {
            least = e;
            best = f;
        }
    }
    return best;
}

static int summarise(const struct ggn_curve *curves, const struct ggn_calibration_block *blocks, int n, struct ggn_calibration *c, struct base_err *err)
{
    double *room = malloc(3 * (size_t)n * sizeof *room);
    if (!room)
        return base_fail_nomem(err, "calibration");
    double *errors = room, *scratch = room + n, *human = room + 2 * n;
    int form = best_form(curves, blocks, n, -1, errors, scratch);
    double tau = fit_tau(curves, blocks, n, form, -1, scratch);
    c->n = n;
    c->observer = (struct ggn_observer){.map = maps[form / (MASKINGS * PERCENTILES)].map, .blur_px = maps[form / (MASKINGS * PERCENTILES)].blur_px,
                                        .masking = maskings[form / PERCENTILES % MASKINGS].k, .window_px = maskings[form / PERCENTILES % MASKINGS].window_px,
                                        .percentile = percentiles[form % PERCENTILES], .tau = tau, .spread = ggn_observer_default.spread};
    c->loo_mean_abs_log2 = loo_error(curves, blocks, n, form, -1, errors, scratch);
    c->loo_median_abs_log2 = ggn_stats_quantile(errors, (size_t)n, 0.5);
    for (int i = 0; i < n; i++)
        errors[i] = fabs(log2(predict(curves, i, form, tau) / blocks[i].human));
    c->median_abs_log2 = ggn_stats_quantile(errors, (size_t)n, 0.5);
    for (int i = 0; i < n; i++) {
        int chosen = best_form(curves, blocks, n, i, errors, scratch);
        c->predicted[i] = predict(curves, i, chosen, fit_tau(curves, blocks, n, chosen, i, scratch));
    }
    for (int i = 0; i < n; i++) {
        errors[i] = fabs(log2(c->predicted[i] / blocks[i].human));
        human[i] = blocks[i].human;
    }
    c->nested_mean_abs_log2 = ggn_stats_mean(errors, (size_t)n);
    c->nested_median_abs_log2 = ggn_stats_quantile(errors, (size_t)n, 0.5);
    int rc = ggn_stats_spearman(human, c->predicted, (size_t)n, &c->spearman, err);
    free(room);
    return rc;
}

void ggn_calibration_release(struct ggn_calibration *c)
{
    free(c->predicted);
    *c = (struct ggn_calibration){0};
}

int ggn_observer_calibrate(const struct ggn_calibration_block *blocks, int n, enum ggn_observer_source source,
                           struct base_threads *threads, struct ggn_calibration *out, struct base_err *err)
{
    struct ggn_calibration c = {0};
    int rc = 0;
    if (n < 3)
        return base_fail(err, BASE_EINVAL, "calibration needs at least 3 blocks with a human threshold below the cap, there are %d", n);
    struct job job = {.blocks = blocks, .source = source};
    job.curves = calloc((size_t)n * FORMS, sizeof *job.curves);
    job.rc = calloc((size_t)n, sizeof *job.rc);
    job.errs = calloc((size_t)n, sizeof *job.errs);
    c.predicted = malloc((size_t)n * sizeof *c.predicted);
    if (!job.curves || !job.rc || !job.errs || !c.predicted) {
        rc = base_fail_nomem(err, "calibration");
        goto out;
    }
    base_threads_for(threads, n, run_block, &job);
    for (int i = 0; i < n && !rc; i++)
        if (job.rc[i] != 0)
            rc = base_fail(err, job.rc[i], "%s", job.errs[i].text);
    if (!rc)
        rc = summarise(job.curves, blocks, n, &c, err);
out:
    for (int i = 0; i < n * FORMS && job.curves; i++)
        ggn_curve_release(&job.curves[i]);
    free(job.curves);
    free(job.rc);
    free(job.errs);
    if (rc)
        ggn_calibration_release(&c);
    else
        *out = c;
    return rc;
}

/* --- raw trials --- */

enum { TRIAL_BLOCKS = 256 };

struct trial {
    int block, seen;
    double log2_spp;
};

/* Lines that are no trial (two that ran into one another, level 0) are left out and counted. */
static int parse_trials(const char *path, char *text, struct trial **out, int *count, int *skipped, struct base_err *err)
{
    size_t room = 1;
    for (const char *p = text; *p != '\0'; p++)
        room += *p == '\n';
    struct trial *t = malloc(room * sizeof *t);
    int n = 0;
    *skipped = 0;
    if (!t)
        return base_fail_nomem(err, path);
    for (char *line = text, *next; line && *line != '\0'; line = next) {
        char *end = line;
        next = strchr(line, '\n');
        if (next)
            *next++ = '\0';
        double block = strtod(line, &end), level = *end == ';' ? strtod(end + 1, &end) : -1.0, seen = *end == ';' ? strtod(end + 1, &end) : -1.0;
        if (!(block >= 0 && block < TRIAL_BLOCKS) || !(level > 0 && level < 1e6) || (seen != 0.0 && seen != 1.0) ||
            end[strspn(end, "\r \t")] != '\0')
            ++*skipped;
        else
            t[n++] = (struct trial){(int)block, seen == 1.0, log2(20.0 * level)};
    }
    *out = t;
    *count = n;
    return 0;
}

/* Log-likelihood of one block's trials for threshold x (log2) and spread s. A lapse rate of 2 % keeps one slip from ruling. */
static double likelihood(const struct trial *t, int n, int block, double x, double s)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        if (t[i].block == block) {
            double p = 0.01 + 0.98 * 0.5 * erfc((t[i].log2_spp - x) / (s * sqrt(2.0)));
            sum += log(t[i].seen ? p : 1.0 - p);
        }
    return sum;
}

int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err)
{
    char *text;
    size_t size;
    struct trial *t = NULL;
    int n = 0, present[TRIAL_BLOCKS] = {0};
    int rc = base_file_read(path, 1 << 26, &text, &size, err);
    if (rc)
        return rc;
    rc = parse_trials(path, text, &t, &n, skipped, err);
    free(text);
    if (rc)
        return rc;
    *blocks = 0;
    for (int i = 0; i < n; i++)
        *blocks += present[t[i].block]++ == 0;
    double best = -INFINITY;
    for (double s = 0.05; s < 3.0; s *= 1.05) {
        double sum = 0.0;
        for (int b = 0; b < TRIAL_BLOCKS; b++) {
            double most = -INFINITY;
            for (double x = 4.0; present[b] > 0 && x <= 14.0; x += 0.05)
                most = fmax(most, likelihood(t, n, b, x, s));
            sum += present[b] > 0 ? most : 0.0;
        }
        if (sum > best) {
            best = sum;
            *spread = s;
        }
    }
    free(t);
    *trials = n;
    return n > 0 ? 0 : base_fail(err, BASE_EINVAL, "%s: no trials in it", path);
}
