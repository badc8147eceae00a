#include "study/people.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "figures/stats.h"

const struct ggn_study_block *ggn_study_cell_block(const struct ggn_study_people *p, int cell, int *view)
{
    int v = 0;
    while (v + 1 < p->study->n_views && cell >= p->first[v + 1])
        v++;
    if (view)
        *view = v;
    return &p->study->views[v].blocks[cell - p->first[v]];
}

double ggn_study_cell_cap(const struct ggn_study_people *p, int cell)
{
    const struct ggn_study_block *b = ggn_study_cell_block(p, cell, NULL);
    return log2(b->levels[b->n_levels - 1]);
}

static void release_result(struct ggn_study_result *r)
{
    free(r->cells);
    free(r->choices);
    free(r->choice_cells);
    free(r->judgements);
}

void ggn_study_people_release(struct ggn_study_people *p)
{
    for (int i = 0; i < p->n; i++)
        release_result(&p->results[i]);
    free(p->results);
    free(p->first);
    *p = (struct ggn_study_people){0};
}

struct input {                      /* what the estimates of one person are made from */
    struct ggn_study_trial *trials; /* owns; of every slot the last revision, by slot */
    int n;
    struct ggn_study_plan plan;
};

struct work {
    struct ggn_study_people *people;
    struct input *inputs;  /* [n] */
    int *rc;               /* [n] */
    struct base_err *errs; /* [n] */
};

/* Nobody can have looked in so short a time. Catch trials count all the same. */
static int is_fast(const struct ggn_study_people *p, const struct ggn_study_trial *t) { return t->ms < p->study->min_ms; }

/* --- two intervals --- */

static int read_choices(const struct ggn_study_people *p, const struct input *in, struct ggn_study_result *r,
                        struct base_err *err)
{
    r->choices = malloc((size_t)(in->n + 1) * sizeof *r->choices);
    r->choice_cells = malloc((size_t)(in->n + 1) * sizeof *r->choice_cells);
    if (!r->choices || !r->choice_cells)
        return base_fail_nomem(err, "estimates");
    for (int i = 0; i < in->n; i++) {
        const struct ggn_study_slot *s = &in->plan.slots[in->trials[i].slot];
        int correct = in->trials[i].answer == s->side + 1;
        double x = s->catch_trial ? GGN_STUDY_PLAIN : log2(in->trials[i].level);
        r->catch_total += s->catch_trial != 0;
        r->catch_passed += s->catch_trial && correct;
        int dropped;
        ggn_study_slot_times(p->study, s, in->trials[i].frame_ms, &dropped);
        r->dropped += dropped > 0;
        if (is_fast(p, &in->trials[i]) || dropped > 0)
            continue;
        r->choices[r->n_choices] = (struct ggn_study_choice){x, s->side == 0, correct};
        r->choice_cells[r->n_choices++] = p->first[s->view] + s->block;
    }
    return 0;
}

/* --- adjustment --- */

/* The mean of log2 of the settings; the interval from the scatter of all blocks around their own means, Student's t. */
static int read_settings(const struct ggn_study_people *p, const struct input *in, struct ggn_study_result *r,
                         struct base_err *err)
{
    double *sums = calloc(2 * (size_t)p->n_cells + 1, sizeof *sums), *squares = sums + p->n_cells, within = 0.0;
    int df = 0;
    if (!sums)
        return base_fail_nomem(err, "estimates");
    for (int i = 0; i < in->n; i++) {
        const struct ggn_study_slot *s = &in->plan.slots[in->trials[i].slot];
        int cell = p->first[s->view] + s->block;
        double x = log2(in->trials[i].level);
        r->settings++;
        r->untouched += p->study->views[s->view].blocks[s->block].levels[s->start] == in->trials[i].level;
        if (is_fast(p, &in->trials[i]))
            continue;
        sums[cell] += x;
        squares[cell] += x * x;
        r->cells[cell].trials++;
    }
    for (int c = 0; c < p->n_cells; c++)
        if (r->cells[c].trials > 1) {
            within += fmax(squares[c] - sums[c] * sums[c] / r->cells[c].trials, 0.0);
            df += r->cells[c].trials - 1;
        }
    double sd = df > 0 ? sqrt(within / df) : (double)NAN;
    for (int c = 0; c < p->n_cells; c++) {
        struct ggn_study_estimate *e = &r->cells[c];
        if (e->trials == 0)
            continue;
        e->t = sums[c] / e->trials;
        e->se = sd / sqrt(e->trials);
        e->lo = df > 0 ? e->t - ggn_study_t975(df) * e->se : (double)NAN;
        e->hi = df > 0 ? e->t + ggn_study_t975(df) * e->se : (double)NAN;
        e->spread = sd;
        e->spread_lo = e->spread_hi = (double)NAN;
    }
    free(sums);
    return 0;
}

/* --- validation --- */

static int read_judgements(const struct ggn_study_people *p, const struct input *in, struct ggn_study_result *r,
                           struct base_err *err)
{
    r->judgements = malloc((size_t)(in->n + 1) * sizeof *r->judgements);
    if (!r->judgements)
        return base_fail_nomem(err, "judgements");
    for (int i = 0; i < in->n; i++) {
        const struct ggn_study_slot *s = &in->plan.slots[in->trials[i].slot];
        const struct ggn_study_trial *t = &in->trials[i];
        r->catch_total += s->catch_trial != 0;
        r->catch_passed += s->catch_trial && t->answer == (s->catch_trial == GGN_STUDY_CATCH_IDENTICAL);
        if (!is_fast(p, t))
            r->judgements[r->n_judgements++] = (struct ggn_study_judgement){s->view, s->condition, t->answer, t->rating};
    }
    return 0;
}

/* --- people --- */

/* How much was done, when and how quickly. */
static int read_times(const struct ggn_study_people *p, const struct input *in, struct ggn_study_result *r,
                      struct base_err *err)
{
    double *ms = malloc((size_t)(in->n + 1) * sizeof *ms);
    if (!ms)
        return base_fail_nomem(err, "times of answers");
    for (int i = 0; i < in->n; i++) {
        const struct ggn_study_trial *t = &in->trials[i];
        ms[i] = t->ms;
        r->minutes += t->ms / 60000.0;
        r->fast += is_fast(p, t);
        if (strcmp(t->at, r->last) > 0)
            strcpy(r->last, t->at);
    }
    r->done = in->n;
    r->of = in->plan.n;
    r->median_s = ggn_stats_quantile(ms, (size_t)in->n, 0.5) / 1000.0;
    free(ms);
    return 0;
}

static void exclude(const struct ggn_study *s, struct ggn_study_result *r)
{
    if (r->catch_total > 0 && r->catch_passed < s->min_catch_passed * r->catch_total)
        snprintf(r->excluded, sizeof r->excluded, "%d of %d catch trials passed", r->catch_passed, r->catch_total);
    else if (r->settings > 0 && r->untouched > s->max_untouched * r->settings)
        snprintf(r->excluded, sizeof r->excluded, "%d of %d settings left where they started", r->untouched, r->settings);
    else if (r->fast > s->max_fast * r->done)
        snprintf(r->excluded, sizeof r->excluded, "%d of %d answers in less than %g ms", r->fast, r->done, s->min_ms);
}

static void work_person(void *data, long i, int worker)
{
    struct work *w = data;
    struct ggn_study_people *p = w->people;
    struct ggn_study_result *r = &p->results[i];
    const struct input *in = &w->inputs[i];
    (void)worker;
    w->rc[i] = read_times(p, in, r, &w->errs[i]);
    if (w->rc[i])
        return;
    if (p->study->task == GGN_STUDY_TWO_INTERVAL)
        w->rc[i] = read_choices(p, in, r, &w->errs[i]);
    else if (p->study->task == GGN_STUDY_ADJUSTMENT)
        w->rc[i] = read_settings(p, in, r, &w->errs[i]);
    else
        w->rc[i] = read_judgements(p, in, r, &w->errs[i]);
    exclude(p->study, r);
}

/* Keeps the last revision of every slot; drops what the plan does not know (a file written by something else). */
static void keep_last(struct input *in)
{
    int n = 0;
    for (int i = 0; i < in->n; i++) {
        int known = in->trials[i].slot >= 0 && in->trials[i].slot < in->plan.n;
        if (known && n > 0 && in->trials[n - 1].slot == in->trials[i].slot)
            n--;
        if (known)
            in->trials[n++] = in->trials[i];
    }
    in->n = n;
}

static int read_inputs(struct work *w, const struct ggn_study *study, struct ggn_study_store *store,
                       const struct ggn_study_person *list, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < w->people->n && !rc; i++) {
        struct ggn_study_result *r = &w->people->results[i];
        snprintf(r->id, sizeof r->id, "%s", list[i].id);
        r->cells = calloc((size_t)w->people->n_cells + 1, sizeof *r->cells);
        rc =
            r->cells ? ggn_study_plan_init(&w->inputs[i].plan, study, list[i].seed, err) : base_fail_nomem(err, "estimates");
        if (!rc)
            rc = ggn_study_store_trials(store, list[i].row, &w->inputs[i].trials, &w->inputs[i].n, err);
        if (!rc)
            keep_last(&w->inputs[i]);
    }
    return rc;
}

static int make_cells(struct ggn_study_people *p, const struct ggn_study *study, struct base_err *err)
{
    p->study = study;
    p->first = calloc((size_t)study->n_views + 1, sizeof *p->first);
    if (!p->first)
        return base_fail_nomem(err, "estimates");
    for (int v = 0; v < study->n_views; v++)
        p->first[v + 1] = p->first[v] + study->views[v].n_blocks;
    p->n_cells = p->first[study->n_views];
    return 0;
}

int ggn_study_people_init(struct ggn_study_people *people, const struct ggn_study *study, struct ggn_study_store *store,
                          struct base_threads *threads, struct base_err *err)
{
    struct ggn_study_people p = {0};
    struct ggn_study_person *list = NULL;
    int n = 0, rc = make_cells(&p, study, err);
    if (!rc)
        rc = ggn_study_store_people(store, &list, &n, err);
    size_t room = n > 0 ? (size_t)n : 1;
    struct work w = {.people = &p,
                     .inputs = calloc(room, sizeof *w.inputs),
                     .rc = calloc(room, sizeof *w.rc),
                     .errs = calloc(room, sizeof *w.errs)};
    p.results = calloc(room, sizeof *p.results);
    if (!rc && (!w.inputs || !w.rc || !w.errs || !p.results))
        rc = base_fail_nomem(err, "estimates");
    if (!rc) {
        p.n = n;
        rc = read_inputs(&w, study, store, list, err);
    }
    if (!rc)
        base_threads_for(threads, n, work_person, &w);
    for (int i = 0; i < p.n; i++) {
        if (!rc && w.rc[i])
            rc = base_fail(err, w.rc[i], "%s", w.errs[i].text);
        free(w.inputs[i].trials);
        ggn_study_plan_release(&w.inputs[i].plan);
    }
    free(w.inputs);
    free(w.rc);
    free(w.errs);
    free(list);
    if (rc)
        ggn_study_people_release(&p);
    else
        *people = p;
    return rc;
}

/* --- estimates of two intervals --- */

/* The blocks with enough choices, estimated together. */
static int estimate_choices(const struct ggn_study_people *p, struct ggn_study_result *r, struct base_err *err)
{
    struct ggn_study_choice *sorted = malloc((size_t)(r->n_choices + 1) * sizeof *sorted); /* by cell */
    struct ggn_study_curve *curves = calloc((size_t)p->n_cells + 1, sizeof *curves);
    int *cells = malloc(((size_t)p->n_cells + 1) * sizeof *cells), n_curves = 0, used = 0;
    int rc = sorted && curves && cells ? 0 : base_fail_nomem(err, "estimates");
    for (int cell = 0; cell < p->n_cells && !rc; cell++) {
        const struct ggn_study_block *b = ggn_study_cell_block(p, cell, NULL);
        int first = used;
        for (int i = 0; i < r->n_choices; i++)
            if (r->choice_cells[i] == cell)
                sorted[used++] = r->choices[i];
        if (used - first < GGN_STUDY_MIN_TRIALS)
            continue;
        curves[n_curves] = (struct ggn_study_curve){.choices = sorted + first,
                                                    .n = used - first,
                                                    .x_min = log2(b->levels[0]),
                                                    .x_max = log2(b->levels[b->n_levels - 1])};
        cells[n_curves++] = cell;
    }
    if (!rc)
        rc = ggn_study_psychometric(curves, n_curves, err);
    for (int i = 0; i < n_curves && !rc; i++)
        r->cells[cells[i]] = curves[i].estimate;
    free(cells);
    free(curves);
    free(sorted);
    return rc;
}

struct estimates {
    const struct ggn_study_people *people;
    int *rc;               /* [n] */
    struct base_err *errs; /* [n] */
};

static void work_estimate(void *data, long i, int worker)
{
    struct estimates *w = data;
    (void)worker;
    w->rc[i] = estimate_choices(w->people, &w->people->results[i], &w->errs[i]);
}

int ggn_study_people_estimate(struct ggn_study_people *p, struct base_threads *threads, struct base_err *err)
{
    if (p->study->task != GGN_STUDY_TWO_INTERVAL || p->n == 0)
        return 0;
    struct estimates w = {p, calloc((size_t)p->n, sizeof *w.rc), calloc((size_t)p->n, sizeof *w.errs)};
    int rc = w.rc && w.errs ? 0 : base_fail_nomem(err, "estimates");
    if (!rc)
        base_threads_for(threads, p->n, work_estimate, &w);
    for (int i = 0; i < p->n && !rc; i++)
        if (w.rc[i])
            rc = base_fail(err, w.rc[i], "%s", w.errs[i].text);
    free(w.rc);
    free(w.errs);
    return rc;
}
