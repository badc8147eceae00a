#include "host/frame.h"

#include <math.h>

/* Between checks that the criterion did not place, samples grow by this factor: cost of checks stays proportional to
 * log(spp) and a block overshoots its threshold by 15 % at most. */
static const double CHECK_RATIO = 1.15;

const char *lull_host_reason(int32_t reason)
{
    static const char *const names[LULL_REASON_COUNT] = {"none", "criterion", "spp-max", "uniform",
                                                         "time", "interrupt", "dropped"};
    return reason >= 0 && reason < LULL_REASON_COUNT ? names[reason] : "unknown";
}

uint32_t lull_host_active(const struct lull_host_blocks *b)
{
    uint32_t n = 0;
    for (uint32_t i = 0; b && i < b->count; i++)
        n += b->list[i].reason == LULL_REASON_NONE;
    return n;
}

double lull_host_elapsed_s(const struct lull_host_frame *f) { return f->totals.render_s + f->totals.criterion_s; }

int32_t lull_host_out_of_time(const struct lull_host_frame *f)
{
    return f->config.time_budget_s > 0.0 && lull_host_elapsed_s(f) >= f->config.time_budget_s;
}

uint64_t lull_host_next_check(const struct lull_host_blocks *b, uint64_t spp, uint64_t asked)
{
    if (spp >= b->spp_max)
        return b->spp_max;
    uint64_t next = asked > spp ? asked : (uint64_t)ceil((double)spp * CHECK_RATIO);
    if (next <= spp)
        next = spp + 1;
    uint64_t most = b->flags & LULL_HOST_OPEN_ENDED ? LULL_HOST_MOST_SPP : b->spp_max;
    if (next > most)
        return most;
    uint64_t step = b->check_step > 0 ? b->check_step : 1, beyond = next % step;
    next += beyond > 0 ? step - beyond : 0;
    return next > most ? most : next;
}

uint64_t lull_host_goal(const struct lull_host_blocks *b, const struct lull_host_block *block)
{
    return block->next_spp > b->spp_max ? b->spp_max : block->next_spp;
}

static int touch(const struct lull_host_block *a, const struct lull_host_block *b)
{
    int beside = a->x1 == b->x0 || b->x1 == a->x0, above = a->y1 == b->y0 || b->y1 == a->y0;
    return (beside && a->y0 < b->y1 && b->y0 < a->y1) || (above && a->x0 < b->x1 && b->x0 < a->x1);
}

static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

/* Samples of the block's most sampled edge neighbour. */
static uint64_t neighbour_spp(const struct lull_host_blocks *b, uint32_t i)
{
    uint64_t most = 0;
    if (b->list_columns == 0) {
        for (uint32_t k = 0; k < b->count; k++)
            most = k != i && touch(&b->list[k], &b->list[i]) ? larger(most, b->list[k].spp) : most;
        return most;
    }
    uint32_t column = i % b->list_columns;
    if (column > 0)
        most = larger(most, b->list[i - 1].spp);
    if (column + 1 < b->list_columns)
        most = larger(most, b->list[i + 1].spp);
    if (i >= b->list_columns)
        most = larger(most, b->list[i - b->list_columns].spp);
    if (i + b->list_columns < b->count)
        most = larger(most, b->list[i + b->list_columns].spp);
    return most;
}

uint32_t lull_host_reopen(struct lull_host_blocks *b, double max_seam)
{
    uint32_t reopened = 0;
    for (uint32_t i = 0; i < b->count && max_seam >= 1.0; i++) {
        struct lull_host_block *block = &b->list[i];
        if (block->reason != LULL_REASON_CRITERION && block->reason != LULL_REASON_DROPPED)
            continue;
        uint64_t need = (uint64_t)ceil((double)neighbour_spp(b, i) / max_seam);
        if (need <= block->spp)
            continue;
        block->reason = LULL_REASON_NONE;
        block->next_spp = lull_host_next_check(b, block->spp, need);
        reopened++;
    }
    return reopened;
}

uint32_t lull_host_extend(struct lull_host_blocks *b)
{
    uint32_t reopened = 0;
    for (uint32_t i = 0; i < b->count; i++) {
        struct lull_host_block *block = &b->list[i];
        const uint64_t most = larger(block->spp, b->spp_max);
        if (b->flags & LULL_HOST_UNIFORM || (block->next_spp > most && !(b->flags & LULL_HOST_OPEN_ENDED)))
            block->next_spp = most;
        int limit = block->reason == LULL_REASON_SPP_MAX || block->reason == LULL_REASON_TIME ||
                    block->reason == LULL_REASON_INTERRUPT || block->reason == LULL_REASON_UNIFORM;
        if (!limit || block->spp >= b->spp_max)
            continue;
        block->reason = LULL_REASON_NONE;
        block->next_spp =
            lull_host_next_check(b, block->spp, block->next_spp > block->spp ? block->next_spp : block->spp + 1);
        reopened++;
    }
    return reopened;
}

static void keep_answer(struct lull_host_frame *f, uint32_t block)
{
    const struct lull_host_block *b = &f->blocks.list[block];
    struct lull_host_answer *list = f->answers + (size_t)block * f->answer_room;
    uint32_t *count = &f->answer_count[block];
    if (*count == f->answer_room) {
        *count /= 2;
        for (uint32_t i = 0; i < *count; i++)
            list[i] = list[2 * i];
    }
    list[(*count)++] = (struct lull_host_answer){b->spp, b->error, b->p_noisy};
}

void lull_host_note(struct lull_host_frame *f, const uint32_t *due, uint32_t count, const struct lull_decision *decisions)
{
    for (uint32_t k = 0; k < count; k++) {
        struct lull_host_block *b = &f->blocks.list[due[k]];
        b->checks++;
        b->asked = 1;
        b->asked_spp = b->spp;
        b->p_noisy = decisions[k].p_noisy;
        b->error = decisions[k].error;
        b->predicted_spp = decisions[k].predicted_spp;
        if (f->answer_room > 0)
            keep_answer(f, due[k]);
    }
}

/* Of a block that has all the samples that it may get. */
static int32_t reason_at_most(const struct lull_host_blocks *blocks)
{
    return blocks->flags & LULL_HOST_UNIFORM ? LULL_REASON_UNIFORM : LULL_REASON_SPP_MAX;
}

/* A block that dropped samples stops at the second STOP in a row, and never counts as converged. */
static void apply_one(const struct lull_host_blocks *blocks, struct lull_host_block *b, const struct lull_decision *d)
{
    int stop = d->action == LULL_STOP && b->spp >= blocks->spp_min;
    b->stop_votes = stop ? b->stop_votes + 1 : 0;
    if (blocks->flags & LULL_HOST_UNIFORM)
        b->reason = LULL_REASON_UNIFORM;
    else if (stop && b->dropped == 0)
        b->reason = LULL_REASON_CRITERION;
    else if (stop && b->stop_votes > 1)
        b->reason = LULL_REASON_DROPPED;
    else if (b->spp >= blocks->spp_max)
        b->reason = reason_at_most(blocks);
    else {
        b->reason = LULL_REASON_NONE;
        b->next_spp = lull_host_next_check(blocks, b->spp, d->next_spp);
    }
}

/* A time budget.
 * Time that does not suffice for every block is spent where noise is seen most: only blocks of about the largest error are
 * asked, and so go on; the others wait at their checks. About the same is what half as many samples again make up for, and
 * no block goes further than that unasked. A render that is resumed differs from one without a budget, therefore.
 */
static const double BUDGET_STEP = 1.5;

static int spends_a_budget(const struct lull_host_frame *f)
{
    return f->config.time_budget_s > 0.0 && !(f->blocks.flags & LULL_HOST_UNIFORM);
}

/* The error of a block now, in that which a mask asks for: that of its last answer, falling as 1/sqrt(spp).
 * INFINITY: it was never asked; NaN: its criterion tells none. */
static double error_now(const struct lull_host_block *b)
{
    if (!b->asked)
        return (double)INFINITY;
    return b->error * sqrt((double)b->asked_spp / (double)b->spp) / lull_host_mask_factor(b->step);
}

static int can_go_on(const struct lull_host_blocks *blocks, const struct lull_host_block *b)
{
    return b->reason == LULL_REASON_NONE && b->spp < blocks->spp_max;
}

/* The error below which blocks wait; 0 without a time budget, or where errors are not known. */
static double waits_below(const struct lull_host_frame *f)
{
    double largest = 0.0;
    for (uint32_t i = 0; spends_a_budget(f) && i < f->blocks.count; i++)
        if (can_go_on(&f->blocks, &f->blocks.list[i]))
            largest = fmax(largest, error_now(&f->blocks.list[i]));
    return largest / sqrt(BUDGET_STEP);
}

void lull_host_apply(struct lull_host_frame *f, const uint32_t *due, uint32_t count, const struct lull_decision *decisions)
{
    lull_host_note(f, due, count, decisions);
    for (uint32_t k = 0; k < count; k++) {
        struct lull_host_block *b = &f->blocks.list[due[k]];
        struct lull_decision d = decisions[k];
        const double most = BUDGET_STEP * (double)b->spp;
        if (spends_a_budget(f) && d.error >= 0.0 && (double)d.next_spp > most)
            d.next_spp = (uint64_t)most;
        apply_one(&f->blocks, b, &d);
    }
}

/* Checks may take config.max_check_overhead of the elapsed time: beyond it they are left out until rendering caught up. */
static int too_expensive(const struct lull_host_frame *f)
{
    double share = f->config.max_check_overhead;
    return share > 0.0 && f->totals.criterion_s > share * lull_host_elapsed_s(f);
}

/* Blocks at spp_max are asked for the last time, and together: what was before can be gone on with. */
static int waits(const struct lull_host_blocks *blocks)
{
    int waits = 0;
    for (uint32_t i = 0; i < blocks->count && (blocks->flags & LULL_HOST_OPEN_ENDED); i++)
        waits |= blocks->list[i].reason == LULL_REASON_NONE && blocks->list[i].spp < blocks->spp_max;
    return waits;
}

uint32_t lull_host_due(struct lull_host_frame *f, uint32_t *due, uint8_t *final)
{
    const struct lull_decision undecided = lull_host_undecided();
    struct lull_host_blocks *blocks = &f->blocks;
    int reopens =
        f->criterion && !(blocks->flags & LULL_HOST_UNIFORM) && (f->criterion->table->capabilities & LULL_CAP_REOPENS);
    int skip = !f->criterion || too_expensive(f), wait = waits(blocks);
    const double below = waits_below(f);
    uint32_t n = 0, active = 0;
    for (uint32_t i = 0; i < blocks->count; i++) {
        struct lull_host_block *b = &blocks->list[i];
        int is_active = b->reason == LULL_REASON_NONE;
        int again = reopens && b->reason == LULL_REASON_CRITERION && b->spp < blocks->spp_max;
        if (!is_active && !again)
            continue;
        if (can_go_on(blocks, b) && error_now(b) < below) /* its time goes to blocks of a larger error */
            continue;
        int last = is_active && b->spp >= blocks->spp_max;
        if (last && wait)
            continue;
        if (skip && !(last && f->criterion)) {
            if (is_active)
                apply_one(blocks, b, &undecided);
            f->totals.skipped_checks += f->criterion != NULL;
            continue;
        }
        due[n] = i;
        final[n++] = (uint8_t)last;
        active += (uint32_t)is_active;
    }
    return active > 0 ? n : 0;
}

int32_t lull_host_check(struct lull_host_frame *f, const struct lull_host_view *view, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "frame", f, NULL);
    if (code != LULL_OK)
        return code;
    /* a renderer that never writes spp would be asked for samples for ever, but for the one check of UNIFORM */
    for (uint32_t i = 0; i < f->blocks.count && !(f->blocks.flags & LULL_HOST_UNIFORM); i++)
        if (f->blocks.list[i].reason == LULL_REASON_NONE && f->blocks.list[i].spp == 0)
            return lull_error_set(err, LULL_E_INVALID,
                                  "block %u: spp is 0 at its check, which stands at %llu: the renderer writes the samples "
                                  "that it has",
                                  i, (unsigned long long)f->blocks.list[i].next_spp);
    code = lull_host_check_samples(f, err);
    if (code != LULL_OK)
        return code;
    uint32_t n = lull_host_due(f, f->due, f->final);
    code = n > 0 ? lull_host_ask(f, view, f->due, f->final, n, f->decisions, err) : LULL_OK;
    lull_host_apply(f, f->due, n, f->decisions);
    lull_host_reopen(&f->blocks, f->config.max_seam);
    return code;
}

int32_t lull_host_stop(struct lull_host_frame *f, int32_t reason, const struct lull_host_view *view, struct lull_error *err)
{
    uint32_t n = 0;
    int32_t code = lull_host_given(err, "frame", f, NULL);
    if (code != LULL_OK)
        return code;
    if (reason <= LULL_REASON_NONE || reason >= LULL_REASON_COUNT)
        return lull_error_set(err, LULL_E_INVALID, "reason %d: expected a LULL_REASON_, 1 to %d", reason,
                              LULL_REASON_COUNT - 1);
    for (uint32_t i = 0; i < f->blocks.count; i++) {
        const struct lull_host_block *b = &f->blocks.list[i];
        if (b->reason != LULL_REASON_NONE || b->spp == 0 || (b->asked && b->asked_spp == b->spp))
            continue;
        f->due[n] = i;
        f->final[n++] = 1;
    }
    if (f->criterion && view && n > 0) {
        code = lull_host_ask(f, view, f->due, f->final, n, f->decisions, err);
        lull_host_note(f, f->due, n, f->decisions);
    }
    /* open-ended blocks with all their samples were asked just now for the last time: they end by the answer */
    const int open_ended = (f->blocks.flags & LULL_HOST_OPEN_ENDED) != 0;
    for (uint32_t k = 0; k < n && f->criterion && view && open_ended; k++)
        if (f->blocks.list[f->due[k]].spp >= f->blocks.spp_max)
            apply_one(&f->blocks, &f->blocks.list[f->due[k]], &f->decisions[k]);
    for (uint32_t i = 0; i < f->blocks.count; i++) {
        struct lull_host_block *b = &f->blocks.list[i];
        if (b->reason == LULL_REASON_NONE)
            b->reason = open_ended && b->spp >= f->blocks.spp_max ? reason_at_most(&f->blocks) : reason;
    }
    return code;
}
