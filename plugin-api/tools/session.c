/* SPDX-License-Identifier: MIT
 *
 * One render as a criterion sees it, asked in a chosen manner; every answer is held against the header's rules.
 */
#include "check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

int lc_deterministic(const struct lc *c) { return (c->criterion->capabilities & LULL_CAP_DETERMINISTIC) != 0; }

/* Reports a call that changed the floating-point environment since `before`, and undoes it. */
static void fp_check(struct lc *c, const struct lull_process_state *before, const char *call)
{
    struct lull_process_state after;
    lull_process_state_read(&after);
    LC_EXPECT(c, after.fp_control == before->fp_control, "%s changed the floating-point control register: %#llx, was %#llx",
              call, after.fp_control, before->fp_control);
    LC_EXPECT(c, c->concurrent || after.thread_count <= before->thread_count, "%s started %ld thread(s)", call,
              after.thread_count - before->thread_count);
    const char *changed = lull_process_state_restore(before);
    LC_EXPECT(c, !changed || after.fp_control != before->fp_control, "%s changed %s", call, changed);
}

struct lull_instance *lc_create(struct lc *c, const struct lull_host *host)
{
    struct lull_instance *instance = NULL;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_process_state before;
    lull_process_state_read(&before);
    int32_t status = c->criterion->create(host, c->pairs, c->pair_count, sizeof *c->pairs, &instance, &err);
    fp_check(c, &before, "create");
    if (!LC_EXPECT(c, status == LULL_OK, "create failed (%d): %s", status, err.message))
        return NULL;
    LC_EXPECT(c, instance != NULL, "create succeeded without an instance");
    return instance;
}

int32_t lc_begin(struct lc *c, struct lull_instance *instance, const struct lull_frame *frame, struct lull_error *err)
{
    struct lull_process_state before;
    lull_process_state_read(&before);
    int32_t status = c->criterion->begin_frame(instance, frame, err);
    fp_check(c, &before, "begin_frame");
    return status;
}

void lc_decision_preset(struct lull_decision *d)
{
    *d = (struct lull_decision){
        .action = LULL_CONTINUE, .p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
}

void lc_decision_check(struct lc *c, const struct lull_block *b, const struct lull_decision *d)
{
    const uint32_t known = LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT;
    const int continues = d->action == LULL_CONTINUE;
    const unsigned long long spp = b->spp, next = d->next_spp;
    const double predicted = d->predicted_spp;
    char at[64];
    snprintf(at, sizeof at, "block %u at %llu spp", b->id, spp);
    LC_EXPECT(c, continues || d->action == LULL_STOP, "%s: unknown action %d", at, d->action);
    LC_EXPECT(c, (d->flags & ~known) == 0, "%s: unknown decision flags %#x", at, d->flags);
    LC_EXPECT(c, !continues || next == 0 || next > spp, "%s: next_spp %llu is not later", at, next);
    LC_EXPECT(c, isnan(d->p_noisy) || (d->p_noisy >= 0 && d->p_noisy <= 1), "%s: p_noisy is %g", at, d->p_noisy);
    LC_EXPECT(c, isnan(d->error) || (d->error >= 0 && isfinite(d->error)), "%s: error is %g", at, d->error);
    LC_EXPECT(c, isnan(predicted) || (predicted >= 0 && isfinite(predicted)), "%s: predicted_spp is %g", at, predicted);
    LC_EXPECT(c, spp > 0 || continues, "block %u is stopped without any sample", b->id);
    LC_EXPECT(c, continues || !(d->flags & LULL_DECISION_TOO_EARLY), "%s: stopped, although too early to say", at);
    LC_EXPECT(c, spp >= c->req.first_spp || continues, "block %u is stopped at %llu spp, before first_spp", b->id, spp);
}

static int same_number(double a, double b, int exact)
{
    if (isnan(a) || isnan(b))
        return isnan(a) && isnan(b);
    return exact ? memcmp(&a, &b, sizeof a) == 0 : fabs(a - b) <= 1e-3 * fmax(fabs(a), fabs(b)) + 1e-9;
}

int lc_log_compare(struct lc *c, const struct lc_log *expected, const struct lc_log *got, int exact, const char *what)
{
    for (size_t i = 0; i < expected->count && i < got->count; i++) {
        const struct lc_answer *a = &expected->items[i], *b = &got->items[i];
        const struct lull_decision *p = &a->decision, *q = &b->decision;
        if (a->id == b->id && a->spp == b->spp && p->action == q->action && p->flags == q->flags &&
            same_number(p->p_noisy, q->p_noisy, exact) && same_number(p->error, q->error, exact) &&
            (!exact || (p->next_spp == q->next_spp && same_number(p->predicted_spp, q->predicted_spp, exact))))
            continue;
        lc_fail(c,
                "%s: block %u at %llu spp answers action %d error %.9g p %.9g next %llu, block %u at %llu spp before: "
                "action %d error %.9g p %.9g next %llu",
                what, b->id, (unsigned long long)b->spp, q->action, q->error, q->p_noisy, (unsigned long long)q->next_spp,
                a->id, (unsigned long long)a->spp, p->action, p->error, p->p_noisy, (unsigned long long)p->next_spp);
        return -1;
    }
    int same = expected->count == got->count;
    return LC_EXPECT(c, same, "%s: %zu answers, %zu before", what, got->count, expected->count) ? 0 : -1;
}

enum { GARBAGE = 0xa5 };

/* Elements of `size` bytes, with slack behind each, as a newer host would have them: those with these ids, NULL: the first.
 * The caller frees it. */
static char *spread(struct lc *c, const void *from, size_t size, const uint32_t *ids, uint32_t count, uint32_t slack)
{
    const size_t stride = size + slack;
    char *to = lc_need(c, malloc(count * stride + 1));
    memset(to, GARBAGE, count * stride);
    for (uint32_t i = 0; i < count; i++)
        memcpy(to + i * stride, (const char *)from + (ids ? ids[i] : i) * size, size);
    return to;
}

static void take_decisions(struct lc_session *s, const char *at, const uint32_t *ids, uint32_t count,
                           struct lull_decision *decisions)
{
    const size_t stride = sizeof *decisions + s->manner.slack;
    for (uint32_t i = 0; i < count; i++, at += stride) {
        memcpy(&decisions[ids[i]], at, sizeof *decisions);
        for (size_t k = sizeof *decisions; k < stride; k++)
            if (!LC_EXPECT(s->check, (unsigned char)at[k] == GARBAGE,
                           "evaluate wrote past the end of a decision (stride %zu)", stride))
                break;
    }
}

/* One call of evaluate for some of the blocks. */
static int32_t ask_some(struct lc_session *s, const struct lc_image *image, const uint32_t *ids, uint32_t count,
                        struct lull_decision *decisions, struct lull_error *err)
{
    struct lc *c = s->check;
    const uint32_t slack = s->manner.slack;
    struct lull_view v = image->view;
    v.struct_size += slack;
    for (uint32_t i = 0; i < count; i++)
        lc_decision_preset(&decisions[ids[i]]);
    void *view = spread(c, &v, sizeof v, NULL, 1, slack), *out = spread(c, decisions, sizeof *decisions, ids, count, slack);
    void *blocks = spread(c, s->film.blocks, sizeof *s->film.blocks, ids, count, slack);
    struct lull_process_state before;
    lull_process_state_read(&before);
    int32_t status = c->criterion->evaluate(s->instance, view, blocks, (uint32_t)sizeof *s->film.blocks + slack, out,
                                            (uint32_t)sizeof *decisions + slack, count, err);
    const char *changed = lull_process_state_restore(&before);
    LC_EXPECT(c, !changed, "evaluate changed %s", changed);
    if (status == LULL_OK)
        take_decisions(s, out, ids, count, decisions);
    free(view);
    free(blocks);
    free(out);
    return status;
}

struct ask_thread {
    struct lc_session *s;
    const struct lc_image *image;
    const uint32_t *ids;
    struct lull_decision *decisions;
    struct lull_error err;
    uint32_t first, count, step;
    int32_t status;
};

static void *ask_thread_run(void *arg)
{
    struct ask_thread *t = arg;
    for (uint32_t i = t->first; i < t->count && t->status == LULL_OK; i += t->step)
        t->status = ask_some(t->s, t->image, &t->ids[i], 1, t->decisions, &t->err);
    return NULL;
}

static int32_t ask_concurrently(struct lc_session *s, const struct lc_image *image, const uint32_t *ids, uint32_t count,
                                struct lull_decision *decisions, struct lull_error *err)
{
    enum { THREADS = 4 };
    struct ask_thread threads[THREADS];
    for (uint32_t t = 0; t < THREADS; t++)
        threads[t] = (struct ask_thread){s, image, ids, decisions, *err, t, count, THREADS, LULL_OK};
    lc_at_once(ask_thread_run, threads, sizeof *threads, THREADS);
    int32_t status = LULL_OK;
    for (uint32_t t = 0; t < THREADS; t++) {
        if (threads[t].status != LULL_OK) {
            status = threads[t].status;
            *err = threads[t].err;
        }
    }
    return status;
}

int32_t lc_session_ask(struct lc_session *s, struct lc_image *image, const uint32_t *ids, uint32_t count,
                       struct lull_decision *decisions, struct lull_error *err)
{
    int32_t status = LULL_OK;
    uint32_t order[LC_BLOCKS_MAX];
    struct lc_image own;
    if (!image)
        lc_session_image(s, image = &own);
    double start = base_clock_wall_s();
    for (uint32_t i = 0; i < count; i++)
        order[i] = s->manner.ask == LC_ASK_REVERSED ? ids[count - 1 - i] : ids[i];
    if (s->manner.ask == LC_ASK_SINGLY)
        for (uint32_t i = 0; i < count && status == LULL_OK; i++)
            status = ask_some(s, image, &order[i], 1, decisions, err);
    else if (s->manner.ask == LC_ASK_CONCURRENTLY)
        status = ask_concurrently(s, image, order, count, decisions, err);
    else
        status = ask_some(s, image, order, count, decisions, err);
    if (s->manner.ask == LC_ASK_TWICE && status == LULL_OK) /* the second answer is the one that is logged */
        status = ask_some(s, image, order, count, decisions, err);
    s->evaluate_s += base_clock_wall_s() - start;
    s->evaluated += count;
    lc_image_release(image);
    return status;
}

int lc_session_judge(struct lc_session *s, struct lc_image *image, struct lull_decision decisions[LC_FILM_BLOCKS],
                     const char *what)
{
    uint32_t ids[LC_FILM_BLOCKS] = {0}, count = s->film.block_count;
    struct lull_error err = {.struct_size = sizeof err};
    for (uint32_t i = 0; i < count; i++)
        ids[i] = i;
    int32_t status = lc_session_ask(s, image, ids, count, decisions, &err);
    if (!LC_EXPECT(s->check, status == LULL_OK, "evaluate %s: %d, %s", what, status, err.message))
        return 0;
    for (uint32_t i = 0; i < count; i++)
        lc_decision_check(s->check, &s->film.blocks[i], &decisions[i]);
    return 1;
}

/* A frame struct with a tail, and rectangles with gaps, as the manner asks for. */
static int begin(struct lc_session *s, uint32_t flags)
{
    struct lc *c = s->check;
    const uint32_t slack = s->manner.slack, count = s->film.block_count;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_frame f;
    lc_film_frame(&s->film, &f, s->planes);
    f.struct_size += slack;
    f.flags |= s->manner.frame_flags | flags;
    f.block_stride += slack;
    void *rects = spread(c, s->film.rects, sizeof *s->film.rects, NULL, count, slack);
    f.blocks = rects;
    void *frame = spread(c, &f, sizeof f, NULL, 1, slack);
    int32_t status = lc_begin(c, s->instance, frame, &err);
    /* what begin_frame was given is gone now: a criterion that kept a pointer reads garbage */
    memset(frame, GARBAGE, sizeof f + slack);
    memset(rects, GARBAGE, (size_t)count * f.block_stride);
    free(frame);
    free(rects);
    if (!LC_EXPECT(c, status == LULL_OK, "begin_frame failed (%d): %s", status, err.message))
        return -1;
    s->spp = c->req.first_spp > 2 ? c->req.first_spp : 2;
    s->spp += s->spp % 2;
    s->step = 0;
    s->log.count = 0;
    s->open = 1;
    return 0;
}

int lc_session_open(struct lc_session *s, struct lc *c, const struct lc_manner *manner)
{
    *s = (struct lc_session){.check = c};
    if (manner)
        s->manner = *manner;
    lc_film_init(&s->film, c, &s->manner);
    s->planes = s->manner.required_only ? c->req.planes_required : c->planes;
    s->instance = lc_create(c, s->manner.host);
    if (s->instance && begin(s, 0) == 0)
        return 0;
    lc_session_close(s);
    return -1;
}

int lc_session_restart(struct lc_session *s)
{
    lc_film_release(&s->film);
    lc_film_init(&s->film, s->check, &s->manner);
    return begin(s, LULL_FRAME_RESTART);
}

void lc_session_image(struct lc_session *s, struct lc_image *image)
{
    lc_image_build(image, s->check, &s->film, &s->manner.layout, s->planes);
    if (s->manner.no_all) {
        image->view.all = NULL;
        image->view.all_count = 0;
    }
}

/* Samples for the next step, as the first block that continues has asked for them: at least a quarter more, at most twice
 * as many as now, so that a session stays short. */
static uint64_t next_spp(const struct lc_session *s, const struct lull_decision *decisions, const uint32_t *ids,
                         uint32_t count)
{
    uint64_t wanted = 0;
    for (uint32_t i = 0; i < count && wanted == 0; i++)
        if (decisions[ids[i]].action == LULL_CONTINUE)
            wanted = decisions[ids[i]].next_spp >> (ids[i] % 2);
    uint64_t least = s->spp + s->spp / 4 + 1, most = 2 * s->spp;
    if (wanted == 0)
        wanted = s->spp + s->spp / 2;
    wanted = wanted < least ? least : wanted > most ? most : wanted;
    return wanted + wanted % 2;
}

uint32_t lc_session_advance(struct lc_session *s, uint32_t *ids)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < s->film.block_count; i++)
        if (!(s->film.blocks[i].flags & LULL_BLOCK_STOPPED)) {
            lc_film_advance(&s->film, i, s->spp << (i % 2)); /* neighbours with different spp */
            ids[count++] = i;
        }
    return count;
}

int lc_session_step(struct lc_session *s)
{
    struct lull_decision decisions[LC_BLOCKS_MAX];
    uint32_t ids[LC_BLOCKS_MAX] = {0};
    const uint32_t count = lc_session_advance(s, ids);
    struct lull_error err = {.struct_size = sizeof err};
    int32_t status = lc_session_ask(s, NULL, ids, count, decisions, &err);
    if (!LC_EXPECT(s->check, status == LULL_OK, "evaluate failed (%d): %s", status, err.message))
        return -1;
    for (uint32_t i = 0; i < count; i++) {
        struct lull_block *b = &s->film.blocks[ids[i]];
        const struct lull_decision *d = &decisions[ids[i]];
        lc_decision_check(s->check, b, d);
        s->log.items[s->log.count++] = (struct lc_answer){b->id, b->spp, *d};
        if (d->action == LULL_STOP)
            b->flags |= LULL_BLOCK_STOPPED;
    }
    s->spp = next_spp(s, decisions, ids, count);
    s->step++;
    return 0;
}

int lc_session_steps(struct lc_session *s, int steps)
{
    for (int i = 0; i < steps; i++)
        if (lc_session_step(s) != 0)
            return -1;
    return 0;
}

void lc_session_close(struct lc_session *s)
{
    if (s->instance && s->open)
        s->check->criterion->end_frame(s->instance);
    if (s->instance)
        s->check->criterion->destroy(s->instance);
    lc_film_release(&s->film);
    s->instance = NULL;
}

int lc_run(struct lc *c, const struct lc_manner *manner, struct lc_log *log)
{
    struct lc_session s;
    if (lc_session_open(&s, c, manner) != 0)
        return -1;
    int result = lc_session_steps(&s, LC_STEPS);
    *log = s.log;
    lc_session_close(&s);
    return result;
}

int lc_run_as(struct lc *c, const struct lc_manner *manner, const struct lc_log *expected, int exact, const char *what)
{
    struct lc_log got;
    if (lc_run(c, manner, &got) != 0)
        return -1;
    return lc_log_compare(c, expected, &got, exact && lc_deterministic(c), what) != 0;
}

void lc_run_both(struct lc *c, const struct lc_manner *a, const struct lc_manner *b, const char *what)
{
    struct lc_log expected;
    if (lc_run(c, a, &expected) == 0)
        lc_run_as(c, b, &expected, 1, what);
}
