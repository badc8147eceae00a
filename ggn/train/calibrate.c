#include "train/calibrate.h"

#include <math.h>
#include <stdlib.h>

#include "figures/stats.h"
#include "model/window.h"
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

/* Where the block of list entries first … end − 1 stops; 0 if it does not. */
static double stop_of(const struct ggn_windows *w, int first, int end, const double *logit, const struct ggn_policy *policy, double t)
{
    int passes = 0;

    for (int i = first; i < end; i++) {
        passes = ggn_policy_p(policy, logit[i]) < t ? passes + 1 : 0;
        if (passes >= policy->passes)
            return w->set->chains[w->list[i].chain].spp[w->list[i].last];
    }
    return 0;
}

int ggn_calibrate_stopping(const struct ggn_windows *w, const double *logit, const struct ggn_policy *policy, double t,
                           struct ggn_stopping *out, struct base_err *err)
{
    double *error = malloc(((size_t)w->set->n + 1) * sizeof *error), spent = 0, needed = 0;
    int early = 0, unsure = 0;

    if (!error)
        return base_fail_nomem(err, "thresholds");
    *out = (struct ggn_stopping){0};
    for (int c = 0; c < w->set->n; c++) {
        const struct ggn_chain *chain = &w->set->chains[c];
        if (w->first[c + 1] == w->first[c])
            continue;
        double stop = stop_of(w, w->first[c], w->first[c + 1], logit, policy, t), truth = chain->label.threshold;
        if (stop == 0) /* nothing is known after the end of the chain: right if the noise is seen until there */
            stop = fmax(chain->spp[chain->n_levels - 1], truth);
        early += stop < 0.8 * truth;
        unsure += stop < 0.8 * truth * exp2(chain->spread);
        spent += stop;
        needed += truth;
        error[out->blocks] = fabs(log2(stop / truth));
        out->mean_abs_log2 += error[out->blocks++];
    }
    if (out->blocks) {
        out->early_rate = (double)early / out->blocks;
        out->unsure_rate = (double)unsure / out->blocks;
        out->samples_ratio = spent / needed;
        out->mean_abs_log2 /= out->blocks;
        out->median_abs_log2 = ggn_stats_quantile(error, (size_t)out->blocks, 0.5);
    }
    free(error);
    return 0;
}

int ggn_calibrate_threshold(const struct ggn_windows *w, const double *logit, double early_rate, struct ggn_policy *policy,
                            struct ggn_stopping *out, struct base_err *err)
{
    struct ggn_stopping best = {0};
    double threshold = 0;

    for (int percent = 1; percent <= 99; percent++) {
        struct ggn_stopping now;
        int rc = ggn_calibrate_stopping(w, logit, policy, percent / 100.0, &now, err);
        if (rc)
            return rc;
        if (threshold > 0 && (now.unsure_rate > early_rate || now.mean_abs_log2 >= best.mean_abs_log2))
            continue;
        best = now;
        threshold = percent / 100.0;
    }
    policy->threshold = threshold;
    *out = best;
    return 0;
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

static const double GATE_MARGIN = 1.1, TAIL_MARGIN = 1.5, GINI_MARGIN = 0.25; /* of the distance to 1 */

void ggn_calibrate_limits(const struct ggn_windows *w, struct ggn_policy *policy)
{
    const size_t values = ggn_chains_values(w->set);

    for (int i = 0; i < w->n; i++) {
        const struct ggn_chain *c = &w->set->chains[w->list[i].chain];
        int last = w->list[i].last, first = last - w->length + 1;
        if (c->synthetic || w->list[i].octave < log2(0.8))
            continue;
        double noise = ggn_window_noise(c->noisy + (size_t)first * values, c->noisy + (size_t)last * values, values,
                                        c->spp[first], c->spp[last]);
        policy->gate_noise = fmax(policy->gate_noise, GATE_MARGIN * noise);
        if (w->list[i].octave < 0 || !(c->tail999[last] >= 0) || !(c->gini[last] >= 0))
            continue;
        policy->tail999 = fmax(policy->tail999, TAIL_MARGIN * c->tail999[last]);
        policy->gini = fmax(policy->gini, c->gini[last] + GINI_MARGIN * (1 - c->gini[last]));
    }
}
