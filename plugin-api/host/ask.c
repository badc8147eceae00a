#include "host/frame.h"

#include <lull/criterion_kit.h>

#include <math.h>
#include <stdio.h>

#include "base/clock.h"

struct lull_decision lull_host_undecided(void)
{
    return (struct lull_decision){
        .action = LULL_CONTINUE, .p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
}

struct lull_block lull_host_state_of(const struct lull_host_block *b, uint32_t index, int has_half)
{
    return (struct lull_block){.id = index,
                               .flags = b->reason != LULL_REASON_NONE ? LULL_BLOCK_STOPPED : 0,
                               .x0 = b->x0,
                               .y0 = b->y0,
                               .x1 = b->x1,
                               .y1 = b->y1,
                               .spp = b->spp,
                               .half_spp = has_half ? b->half_spp : 0,
                               .thread_s = b->thread_s};
}

/* Some of the blocks of a frame. */
struct question {
    const struct lull_host_blocks *blocks;
    const uint32_t *due;
    const uint8_t *final; /* may be NULL */
    uint32_t count;
    struct lull_decision *decisions;
};

/* What cannot be is not known. */
static struct lull_decision sensible(struct lull_decision d)
{
    if (!(d.p_noisy >= 0.0 && d.p_noisy <= 1.0))
        d.p_noisy = (double)NAN;
    if (!(d.predicted_spp >= 0.0))
        d.predicted_spp = (double)NAN;
    if (!(d.error >= 0.0))
        d.error = (double)NAN;
    return d;
}

/* Asks the instance of one step about those of the due blocks that are its own. */
static int32_t evaluate_step(struct lull_host_criterion *c, uint32_t step, const struct lull_view *view,
                             const struct question *q, struct lull_error *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    uint32_t n = 0;
    for (uint32_t k = 0; k < q->count; k++) {
        if (q->blocks->list[q->due[k]].step != step)
            continue;
        c->due[n] = c->all[q->due[k]];
        if (q->final && q->final[k])
            c->due[n].flags |= LULL_BLOCK_FINAL;
        c->answers[n++] = q->decisions[k];
    }
    if (n == 0)
        return LULL_OK;
    struct lull_process_state before;
    lull_thread_state_read(&before);
    int32_t code =
        c->table->evaluate(c->instances[step], view, c->due, sizeof c->due[0], c->answers, sizeof c->answers[0], n, &e);
    lull_host_leave(c, &before, "evaluate");
    n = 0;
    for (uint32_t k = 0; k < q->count && code == LULL_OK; k++)
        if (q->blocks->list[q->due[k]].step == step)
            q->decisions[k] = sensible(c->answers[n++]);
    return code == LULL_OK ? code : lull_host_blame(c, "", code, &e, err);
}

/* Are all of the mask `planes` there, but for counts, which the library makes? */
static int32_t check_announced(uint32_t planes, const struct lull_plane shown[LULL_PLANE_COUNT], struct lull_error *err)
{
    for (int i = 0; i < LULL_PLANE_COUNT; i++)
        if ((planes & ~LULL_HOST_COUNTS & LULL_PLANE_BIT(i)) && !shown[i].data)
            return lull_error_set(err, LULL_E_PLANE, "%s: the view does not have the plane, which the config announced",
                                  lull_kit_plane_name((unsigned)i));
    return LULL_OK;
}

int32_t lull_host_evaluate(struct lull_host_criterion *c, const struct lull_host_frame *f, const struct lull_host_view *view,
                           const uint32_t *due, const uint8_t *final, uint32_t count, struct lull_decision *decisions,
                           struct lull_error *err)
{
    struct lull_host_shown shown;
    for (uint32_t k = 0; decisions && k < count; k++)
        decisions[k] = lull_host_undecided();
    int32_t code = lull_host_given(err, "criterion", c, "frame", f, NULL);
    if (code == LULL_OK && count > 0)
        code = lull_host_given(err, "due", due, "decisions", decisions, NULL);
    if (code != LULL_OK)
        return code;
    const struct lull_host_blocks *b = &f->blocks;
    for (uint32_t k = 0; k < count; k++)
        if (due[k] >= b->count || (k > 0 && due[k] <= due[k - 1]))
            return lull_error_set(err, LULL_E_INVALID, "due[%u] is %u: expected rising indices of %u blocks", k, due[k],
                                  b->count);
    code = lull_host_check_samples(f, err);
    if (code != LULL_OK)
        return code;
    const struct question q = {b, due, final, count, decisions};
    if (c->frame != f || c->block_count != b->count)
        return lull_error_set(err, LULL_E_STATE, "criterion %s: it has not been opened for this frame", c->table->id);
    code = lull_host_show(b, view, lull_host_wants_counts(c), &shown, err);
    if (code != LULL_OK)
        return code;
    /* what a criterion requires it misses itself */
    code = check_announced(f->config.planes & ~c->needs.planes_required, shown.planes, err);
    for (uint32_t i = 0; i < b->count; i++)
        c->all[i] = lull_host_state_of(&b->list[i], i, shown.planes[LULL_PLANE_HALF].data != NULL);
    shown.view.all = c->all;
    shown.view.all_count = b->count;
    shown.view.all_stride = sizeof c->all[0];
    shown.view.elapsed_s = base_clock_wall_s() - c->begin_s;
    for (uint32_t s = 0; s <= LULL_HOST_STEPS && code == LULL_OK; s++)
        code = evaluate_step(c, s, &shown.view, &q, err);
    for (uint32_t k = 0; k < count && code != LULL_OK; k++)
        decisions[k] = lull_host_undecided();
    lull_host_hide(&shown);
    return code == LULL_OK ? lull_host_pass_warning(c, err) : code;
}

/* A criterion of halves stops no block whose half_spp is never written: one warning says so. */
static void miss_halves(struct lull_host_frame *f, const uint32_t *due, uint32_t count)
{
    const struct lull_host_block *b = NULL;
    char text[256];
    if (f->warned_halves || !(f->criterion->needs.planes_required & LULL_PLANE_BIT(LULL_PLANE_HALF)))
        return;
    for (uint32_t k = 0; k < count; k++) {
        b = &f->blocks.list[due[k]];
        if (b->spp < 2 || (b->half_spp > 0 && b->half_spp < b->spp))
            return;
    }
    if (!b)
        return;
    f->warned_halves = 1;
    snprintf(
        text, sizeof text,
        "half_spp is %llu where spp is %llu, in every block: without a half of the samples no block stops. The renderer "
        "writes half_spp as it writes spp",
        (unsigned long long)b->half_spp, (unsigned long long)b->spp);
    lull_host_say(f->criterion, LULL_LOG_WARNING, text);
}

int32_t lull_host_ask(struct lull_host_frame *f, const struct lull_host_view *view, const uint32_t *due,
                      const uint8_t *final, uint32_t count, struct lull_decision *decisions, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "frame", f, "the frame's criterion", f ? f->criterion : NULL, NULL);
    if (code != LULL_OK)
        return code;
    double start_s = base_clock_wall_s(), start_cpu_s = base_clock_process_s();
    code = lull_host_evaluate(f->criterion, f, view, due, final, count, decisions, err);
    /* nothing else runs meanwhile: the process's seconds, with those of the denoiser, are those of the check */
    f->totals.criterion_s += base_clock_wall_s() - start_s;
    f->totals.criterion_thread_s += base_clock_process_s() - start_cpu_s;
    f->totals.checks += count;
    f->totals.asked += count;
    f->totals.failed_checks += code != LULL_OK;
    if (code != LULL_OK)
        return code;
    miss_halves(f, due, count);
    return lull_host_pass_warning(f->criterion, err);
}
