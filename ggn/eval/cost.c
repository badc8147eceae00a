#include "eval/cost.h"

#include <math.h>

void ggn_cost_checks(const struct ggn_method *m, const struct ggn_eval_set *s, double *out)
{
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        out[b] = m->asked ? m->asked[b] : 0.0;
        for (size_t i = block->first; !m->asked && i < block->end && s->spp[i] <= m->stop[b]; i++)
            out[b] += !isnan(ggn_method_verdict(m, i));
    }
}

double ggn_cost_path_s(const struct ggn_eval_set *s, const struct ggn_eval_block *b)
{
    size_t i = b->end;
    while (i-- > b->first)
        if (s->seconds[i] > 0.0)
            return s->seconds[i] / s->spp[i] / ((double)s->images.width * s->images.height);
    return (double)NAN;
}

/* A column at the stop: by `power` of the samples from the case at or before it. */
static double at_stop(const struct ggn_eval_set *s, const struct ggn_eval_block *b, const double *column, double stop,
                      double power)
{
    size_t i = b->first;
    while (i + 1 < b->end && s->spp[i + 1] <= stop)
        i++;
    return column[i] * pow(s->spp[i] / stop, power);
}

void ggn_cost_of(const struct ggn_eval_set *s, enum ggn_split split, int scene, const double *stop, const double *checks,
                 struct ggn_cost *out)
{
    struct ggn_cost c = {0};
    double worst = 0.0, most = 0.0, uniform_s = 0.0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *e = &s->blocks[b];
        if (e->split != split || (scene >= 0 && e->scene != scene))
            continue;
        double rate = ggn_cost_path_s(s, e) * s->images.width * s->images.height, t = e->label.threshold;
        double flip = at_stop(s, e, s->flip, stop[b], 0.5);
        c.blocks++;
        c.samples += stop[b];
        c.sampling_s += stop[b] * rate;
        uniform_s += rate;
        c.checks += checks ? checks[b] : 0.0;
        c.noisy += stop[b] < t;
        c.early += stop[b] < 0.8 * t;
        worst = fmax(worst, t / stop[b]);
        most = fmax(most, t);
        c.flip += flip;
        c.flip_worst = fmax(c.flip_worst, flip);
        c.relmse += at_stop(s, e, s->relmse, stop[b], 1.0);
    }
    double n = c.blocks > 0 ? c.blocks : (double)NAN;
    c.worst = sqrt(worst);
    c.uniform_spp = most / worst;
    c.time_ratio = c.sampling_s / (uniform_s * c.uniform_spp);
    c.samples_ratio = c.samples / (n * c.uniform_spp);
    double *const means[] = {&c.samples, &c.sampling_s, &c.checks, &c.noisy, &c.early, &c.flip, &c.relmse};
    for (size_t i = 0; i < sizeof means / sizeof means[0]; i++)
        *means[i] /= n;
    *out = c;
}
