#include "study/summary.h"

#include <math.h>
#include <stdlib.h>

#include "figures/stats.h"

static int counts(const struct ggn_study_result *r) { return r->excluded[0] == '\0'; }

/* A person's estimate in a cell, not beyond the highest level; NaN without one. */
static double estimate(const struct ggn_study_people *p, int person, int cell)
{
    const struct ggn_study_result *r = &p->results[person];
    return counts(r) && r->cells[cell].trials > 0 ? fmin(r->cells[cell].t, ggn_study_cell_cap(p, cell)) : (double)NAN;
}

/* Half the width of Student's interval of a mean of n > 1 values with these sums. */
static double half_width(double sum, double squares, int n)
{
    return ggn_study_t975(n - 1) * sqrt(fmax(squares - sum * sum / n, 0.0) / (n - 1) / n);
}

static struct ggn_study_threshold threshold(const struct ggn_study_people *p, int cell)
{
    double cap = ggn_study_cell_cap(p, cell), sum = 0.0, squares = 0.0, spread = 0.0;
    struct ggn_study_threshold g = {.t = (double)NAN, .lo = (double)NAN, .hi = (double)NAN, .spread = (double)NAN};
    const struct ggn_study_estimate *last = NULL;
    for (int i = 0; i < p->n; i++) {
        double t = estimate(p, i, cell);
        if (isnan(t))
            continue;
        last = &p->results[i].cells[cell];
        sum += t;
        squares += t * t;
        spread += log2(last->spread);
        g.people++;
        g.trials += last->trials;
        g.at_cap += last->t >= cap;
    }
    if (g.people == 0)
        return g;
    g.t = sum / g.people;
    g.spread = exp2(spread / g.people);
    double half = g.people > 1 ? half_width(sum, squares, g.people) : 0.0;
    g.lo = g.people > 1 ? g.t - half : last->lo;
    g.hi = g.people > 1 ? g.t + half : last->hi;
    return g;
}

void ggn_study_thresholds(const struct ggn_study_people *p, struct ggn_study_threshold *out)
{
    for (int c = 0; c < p->n_cells; c++)
        out[c] = threshold(p, c);
}

/* --- kinds --- */

/* The cell that shows the noisy picture of the same block; -1: none. */
static int noisy_cell(const struct ggn_study_people *p, int cell)
{
    int view, other;
    const struct ggn_study_block *b = ggn_study_cell_block(p, cell, &view);
    for (int c = 0; c < p->n_cells; c++)
        if (ggn_study_cell_block(p, c, &other)->id == b->id && p->study->views[other].kind == GGN_STUDY_NOISY &&
            ggn_study_same_scene(&p->study->views[view], &p->study->views[other]))
            return c;
    return -1;
}

struct ggn_study_difference ggn_study_against_noisy(const struct ggn_study_people *p, enum ggn_study_kind kind, int cell)
{
    struct ggn_study_difference d = {(double)NAN, (double)NAN, (double)NAN, 0, 0};
    double sum = 0.0, squares = 0.0;
    int from = cell < 0 ? 0 : cell, to = cell < 0 ? p->n_cells : cell + 1;
    for (int i = 0; i < p->n; i++) {
        double own = 0.0;
        int blocks = 0;
        for (int c = from; c < to; c++) {
            int view, noisy;
            ggn_study_cell_block(p, c, &view);
            if (p->study->views[view].kind != kind || (noisy = noisy_cell(p, c)) < 0)
                continue;
            double more = estimate(p, i, c) - estimate(p, i, noisy);
            own += isnan(more) ? 0.0 : more;
            blocks += !isnan(more);
        }
        d.blocks = blocks > d.blocks ? blocks : d.blocks;
        d.people += blocks > 0;
        sum += blocks > 0 ? own / blocks : 0.0;
        squares += blocks > 0 ? own / blocks * own / blocks : 0.0;
    }
    if (d.people > 0)
        d.octaves = sum / d.people;
    if (d.people > 1) {
        d.lo = d.octaves - half_width(sum, squares, d.people);
        d.hi = d.octaves + half_width(sum, squares, d.people);
    }
    return d;
}

/* --- agreement --- */

struct pairs {                   /* one person against a mean */
    double *own, *mean, *errors; /* [n_cells] */
    size_t n;
};

static void pair(const struct ggn_study_people *p, int person, int with_self, struct pairs *q)
{
    q->n = 0;
    for (int c = 0; c < p->n_cells; c++) {
        double own = estimate(p, person, c), sum = 0.0;
        int others = 0;
        for (int i = 0; i < p->n; i++) {
            double t = estimate(p, i, c);
            others += i != person && !isnan(t);
            sum += (with_self || i != person) && !isnan(t) ? t : 0.0;
        }
        if (isnan(own) || others == 0)
            continue;
        q->own[q->n] = own;
        q->mean[q->n] = sum / (others + with_self);
        q->errors[q->n] = fabs(own - q->mean[q->n]);
        q->n++;
    }
}

static int add_person(struct ggn_study_ceiling *c, struct pairs *q, int with_self, struct base_err *err)
{
    double rho = 0.0, half = 0.0, one = 0.0;
    int rc = ggn_stats_spearman(q->own, q->mean, q->n, &rho, err);
    for (size_t i = 0; i < q->n; i++) {
        half += q->errors[i] <= 0.5;
        one += q->errors[i] <= 1.0;
    }
    double r = ggn_stats_pearson(q->own, q->mean, q->n), median = ggn_stats_quantile(q->errors, q->n, 0.5);
    *(with_self ? &c->pearson_upper : &c->pearson_lower) += r;
    *(with_self ? &c->spearman_upper : &c->spearman_lower) += rho;
    *(with_self ? &c->median_abs_log2_upper : &c->median_abs_log2_lower) += median;
    if (!with_self) {
        c->within_half_lower += half / (double)q->n;
        c->within_one_lower += one / (double)q->n;
        c->people++;
    }
    c->blocks = (int)q->n > c->blocks ? (int)q->n : c->blocks;
    return rc;
}

int ggn_study_ceiling(const struct ggn_study_people *p, struct ggn_study_ceiling *out, struct base_err *err)
{
    struct ggn_study_ceiling c = {0};
    size_t n = (size_t)p->n_cells + 1;
    double *room = malloc(3 * n * sizeof *room);
    struct pairs q = {room, room + n, room + 2 * n, 0};
    int rc = room ? 0 : base_fail_nomem(err, "agreement");
    for (int i = 0; i < p->n && !rc; i++)
        for (int with_self = 0; with_self < 2 && !rc; with_self++) {
            pair(p, i, with_self, &q);
            if (q.n >= 3)
                rc = add_person(&c, &q, with_self, err);
        }
    free(room);
    double k = c.people > 0 ? c.people : (double)NAN;
    double *means[] = {&c.pearson_lower,         &c.pearson_upper,         &c.spearman_lower,    &c.spearman_upper,
                       &c.median_abs_log2_lower, &c.median_abs_log2_upper, &c.within_half_lower, &c.within_one_lower};
    for (size_t i = 0; i < sizeof means / sizeof means[0]; i++)
        *means[i] /= k;
    if (!rc)
        *out = c;
    return rc;
}

/* --- judgements --- */

static int matches(const struct ggn_study_judgement *j, int view, int condition)
{
    return j->condition >= 0 && (view < 0 || j->view == view) && (condition < 0 || j->condition == condition);
}

struct ggn_study_share ggn_study_share(const struct ggn_study_people *p, int view, int condition)
{
    struct ggn_study_share s = {.share = (double)NAN, .lo = (double)NAN, .hi = (double)NAN, .rating = (double)NAN};
    double ratings = 0.0;
    for (int i = 0; i < p->n; i++)
        for (int k = 0; k < p->results[i].n_judgements && counts(&p->results[i]); k++) {
            const struct ggn_study_judgement *j = &p->results[i].judgements[k];
            if (!matches(j, view, condition))
                continue;
            s.n++;
            s.same += j->same;
            ratings += j->rating;
        }
    if (s.n > 0) {
        s.share = (double)s.same / s.n;
        s.rating = ratings / s.n;
        ggn_study_wilson(s.same, s.n, &s.lo, &s.hi);
    }
    return s;
}

double ggn_study_icc(const struct ggn_study_people *p, int condition)
{
    double between = 0.0, within = 0.0, total = 0.0, sizes = 0.0;
    struct ggn_study_share all = ggn_study_share(p, -1, condition);
    int people = 0;
    for (int i = 0; i < p->n; i++) {
        double n = 0.0, same = 0.0;
        for (int k = 0; k < p->results[i].n_judgements && counts(&p->results[i]); k++) {
            const struct ggn_study_judgement *j = &p->results[i].judgements[k];
            n += matches(j, -1, condition);
            same += matches(j, -1, condition) && j->same;
        }
        if (n == 0.0)
            continue;
        people++;
        total += n;
        sizes += n * n;
        between += n * pow(same / n - all.share, 2.0);
        within += same * (1.0 - same / n);
    }
    if (people < 2 || total - people < 1.0)
        return (double)NAN;
    double n0 = (total - sizes / total) / (people - 1);
    between /= people - 1;
    within /= total - people;
    double sum = between + (n0 - 1.0) * within;
    return sum > 0.0 ? fmax((between - within) / sum, 0.0) : 0.0;
}

int ggn_study_people_needed(double p, double difference, int m, double icc)
{
    const double z = 1.959963984540054 + 0.841621233572914;
    double other = p - difference >= 0.0 ? p - difference : p + difference;
    double judgements = z * z * (p * (1.0 - p) + other * (1.0 - other)) / (difference * difference);
    return (int)ceil(judgements * (1.0 + (m - 1) * icc) / m);
}
