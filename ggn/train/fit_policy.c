#include "train/fit_policy.h"

#include <math.h>
#include <stdlib.h>

#include "sight/stats.h"
#include "nn/loss.h"

void ggn_calibrate_platt(const double *logit, const double *label, int n, struct ggn_policy *policy)
{
    double a = 1, b = 0, positive = 0;
    for (int i = 0; i < n; i++)
        positive += label[i];
    if (positive < 0.5 || positive > n - 0.5)
        return;
    /* Newton's method on −log likelihood + (a − 1)²/2 + b²/200 */
    for (int iteration = 0; iteration < 50; iteration++) {
        double ga = a - 1, gb = b / 100, haa = 1, hab = 0, hbb = 1.0 / 100;
        for (int i = 0; i < n; i++) {
            double p = ggn_sigmoid(a * logit[i] + b), d = p - label[i], h = p * (1 - p);
            ga += d * logit[i];
            gb += d;
            haa += h * logit[i] * logit[i];
            hab += h * logit[i];
            hbb += h;
        }
        double det = haa * hbb - hab * hab;
        double da = (hbb * ga - hab * gb) / det, db = (haa * gb - hab * ga) / det;
        double length = sqrt(da * da + db * db), damp = length > 1 ? 1 / length : 1;
        a -= damp * da;
        b -= damp * db;
        if (length < 1e-10)
            break;
    }
    if (!(a > 1e-3) || !isfinite(b))
        return;
    policy->scale = a;
    policy->shift = b;
}

/* The logits of the windows of a series, which end at consecutive levels; unlabelled ones are not among them and never
 * stop. */
struct known {
    const struct ggn_windows *windows;
    const double *logit;
    int first, end; /* list entries */
};

static double known_logit(void *data, const int *levels)
{
    const struct known *k = data;
    for (int i = k->first; i < k->end; i++)
        if (k->windows->list[i].last == levels[k->windows->length - 1])
            return k->logit[i];
    return (double)NAN;
}

int ggn_checks_create(struct ggn_checks *checks, const struct ggn_windows *w, const double *logit,
                      const struct ggn_policy *policy, struct base_err *err)
{
    const struct ggn_stop_rule rule = {.policy = *policy, .window = w->length};
    size_t levels = 1;
    for (int c = 0; c < w->set->n; c++)
        levels += (size_t)w->set->series[c].n_levels;
    *checks = (struct ggn_checks){.windows = w,
                                  .policy = *policy,
                                  .seen = malloc(levels * sizeof *checks->seen),
                                  .error = malloc(((size_t)w->set->n + 1) * sizeof *checks->error)};
    if (!checks->seen || !checks->error) {
        ggn_checks_release(checks);
        return base_fail_nomem(err, "thresholds");
    }
    struct ggn_seen *seen = checks->seen;
    for (int c = 0; c < w->set->n; c++) {
        struct known known = {w, logit, w->first[c], w->first[c + 1]};
        if (known.end > known.first)
            ggn_replay(&w->set->series[c], &rule, known_logit, &known, NULL, seen);
        seen += w->set->series[c].n_levels;
    }
    return 0;
}

void ggn_checks_release(struct ggn_checks *checks)
{
    free(checks->seen);
    free(checks->error);
    *checks = (struct ggn_checks){0};
}

struct ggn_stopping ggn_calibrate_stopping(const struct ggn_checks *checks, double t)
{
    const struct ggn_windows *w = checks->windows;
    const struct ggn_seen *seen = checks->seen;
    struct ggn_stopping out = {0};
    double spent = 0, needed = 0;
    int early = 0;
    for (int c = 0; c < w->set->n; c++) {
        const struct ggn_level_series *series = &w->set->series[c];
        const struct ggn_seen *own = seen;
        seen += series->n_levels;
        if (w->first[c + 1] == w->first[c])
            continue;
        int level = ggn_replay_stop(own, series->n_levels, checks->policy.passes, t);
        double truth = series->label.threshold;
        /* nothing is known after the end of the series: right if the noise is seen until there */
        double stop = level < 0 ? fmax(series->spp[series->n_levels - 1], truth) : series->spp[level];
        early += stop < 0.8 * truth;
        spent += stop;
        needed += truth;
        checks->error[out.blocks] = fabs(log2(stop / truth));
        out.mean_abs_log2 += checks->error[out.blocks++];
    }
    if (out.blocks) {
        out.early_rate = (double)early / out.blocks;
        out.samples_ratio = spent / needed;
        out.mean_abs_log2 /= out.blocks;
        out.median_abs_log2 = ggn_stats_quantile(checks->error, (size_t)out.blocks, 0.5);
    }
    return out;
}

struct ggn_stopping ggn_calibrate_threshold(const struct ggn_checks *checks, double early_rate, double *threshold)
{
    struct ggn_stopping best = {0};
    *threshold = 0;
    for (int k = 1; k <= 99; k++) {
        const struct ggn_stopping now = ggn_calibrate_stopping(checks, k / 100.0);
        if (*threshold > 0 && (now.early_rate > early_rate || now.mean_abs_log2 >= best.mean_abs_log2))
            continue;
        best = now;
        *threshold = k / 100.0;
    }
    return best;
}

double ggn_calibrate_slope(const struct ggn_windows *w, const double *logit, const struct ggn_policy *policy)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int i = 0; i < w->n; i++) {
        double x = w->list[i].octave, y = policy->scale * logit[i] + policy->shift;
        if (fabs(x) > 1)
            continue;
        n++;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    double det = n * sxx - sx * sx, slope = det > 0 ? -(n * sxy - sx * sy) / det : 0;
    return slope > 0 ? slope : 0;
}
