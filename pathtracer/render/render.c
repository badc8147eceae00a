#include "render/render.h"

#include <math.h>
#include <stdlib.h>

#include "base/clock.h"

/* Length of a slice: short enough for a live line, an interrupt and a time budget, long enough that its barrier costs
 * nothing. */
static const double SLICE_S = 0.25;
/* Workers make it longer by so much for each of their threads, up to a limit: what rank 0 sends in a slice grows with the
 * threads, and should take a small part of it. */
static const double SLICE_PER_WORKER_S = 0.004, LONGEST_SLICE_S = 5.0;

/* Rows that each thread has to choose from in a slice: few enough that a block is sampled in one go, enough that threads and
 * processes end together. Of rows that are shorter than ROW_PIXELS as many more: all blocks are looked at before each slice,
 * and tiny ones are many. */
static const double ROWS_PER_THREAD = 128.0, ROW_PIXELS = 16.0;

/* What a block may get in one slice before others have had as much: its samples again, or this. */
enum { LEAD_SPP = 8 };

int pt_render_threads(const struct pt_render *r)
{
    return base_threads_count(r->threads) + job_worker_threads(r->config.job);
}

static int allocate_work(struct pt_render *r, struct base_err *err)
{
    struct pt_render_work *w = &r->work;
    size_t rows = 0, n = r->blocks->count;
    for (uint32_t i = 0; i < n; i++)
        rows += (size_t)(r->blocks->list[i].y1 - r->blocks->list[i].y0);
    w->items = calloc(rows, sizeof *w->items);
    w->candidates = calloc(n, sizeof *w->candidates);
    w->due = calloc(n, sizeof *w->due);
    w->final = calloc(n, sizeof *w->final);
    w->decisions = calloc(n, sizeof *w->decisions);
    const int all = w->items && w->candidates && w->due && w->final && w->decisions;
    return all ? 0 : base_fail_nomem(err, "work list");
}

uint32_t pt_render_flags(const struct pt_render_config *c)
{
    /* what hangs on the clock is decided otherwise the next time */
    const int deterministic = c->time_budget_s <= 0.0 && c->max_check_overhead <= 0.0;
    const int independent = c->integrator.sampler == PT_SAMPLER_INDEPENDENT;
    return LULL_HOST_HALF_KNOWN | LULL_HOST_OPEN_ENDED | (c->uniform ? LULL_HOST_UNIFORM : 0) |
           (deterministic ? LULL_FRAME_DETERMINISTIC : 0) | (independent ? LULL_FRAME_INDEPENDENT : 0);
}

/* film_planes: PT_FILM_* of its film. */
static int begin_frame(struct pt_render *r, uint32_t film_planes, struct base_err *err)
{
    const struct pt_render_config *c = &r->config;
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_config config = {
        .struct_size = sizeof config,
        .flags = pt_render_flags(c),
        .width = (uint32_t)c->width,
        .height = (uint32_t)c->height,
        .block_width = (uint32_t)c->block_width,
        .block_height = (uint32_t)c->block_height,
        .crop = {c->crop[0], c->crop[1], c->crop[2], c->crop[3]},
        .planes = pt_host_planes_of(film_planes),
        .transfer = LULL_TRANSFER_SRGB,
        .sample_clamp = isfinite(c->integrator.max_component) ? (double)c->integrator.max_component : 0.0,
        .spp_min = c->spp_min,
        .spp_max = c->spp_max,
        .seed = c->integrator.seed,
        .time_budget_s = c->time_budget_s,
        .max_check_overhead = c->max_check_overhead,
        .max_seam = c->max_seam,
        .mask = c->mask,
    };
    int32_t code = lull_host_begin(&config, r->criterion, &r->frame, &e);
    const struct lull_requirements *n = r->criterion ? lull_host_needs(r->criterion) : NULL;
    if (code == LULL_E_UNSUPPORTED && n && !(n->flags & LULL_REQ_FLEXIBLE) && n->block_width > 0)
        return base_fail(err, BASE_EINVAL, "%s: use --block %ux%u", e.message, n->block_width, n->block_height);
    if (code != LULL_OK)
        return pt_host_result(code, &e, err);
    r->blocks = lull_host_blocks_of(r->frame);
    r->totals = lull_host_totals_of(r->frame);
    return 0;
}

int pt_render_create(const struct pt_render_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                     struct base_threads *threads, struct lull_host_criterion *criterion, struct pt_render **out,
                     struct base_err *err)
{
    struct pt_render *r = calloc(1, sizeof *r);
    if (!r)
        return base_fail_nomem(err, "renderer");
    r->config = *config;
    r->scene = scene;
    r->kernel = kernel;
    r->threads = threads;
    r->criterion = criterion;
    uint32_t planes = config->planes | (criterion ? pt_host_film_planes(lull_host_needs(criterion)) : 0);
    r->config.integrator.want_aux = (planes & PT_FILM_AUX) != 0;
    int rc = begin_frame(r, planes, err);
    if (!rc)
        rc = pt_film_init(&r->film, r->blocks->x0, r->blocks->y0, r->blocks->x1, r->blocks->y1, planes, err);
    if (!rc)
        rc = allocate_work(r, err);
    if (rc) {
        pt_render_destroy(r);
        return rc;
    }
    pt_host_show(&r->film, &r->shown);
    *out = r;
    return 0;
}

void pt_render_destroy(struct pt_render *r)
{
    if (!r)
        return;
    free(r->work.items);
    free(r->work.candidates);
    free(r->work.due);
    free(r->work.final);
    free(r->work.decisions);
    lull_host_end(r->frame);
    pt_film_release(&r->film);
    free(r);
}

void pt_render_plan(struct pt_render *r, const uint32_t *spp)
{
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        struct lull_host_block *b = &r->blocks->list[i];
        b->next_spp = spp[i];
        b->reason = b->spp < spp[i] ? LULL_REASON_NONE : LULL_REASON_UNIFORM;
    }
}

static void set_spp(const struct pt_render *r, struct lull_host_block *b, uint64_t spp)
{
    b->spp = spp;
    b->half_spp = r->film.half ? pt_film_half_spp(spp) : 0;
}

/* Another rule is asked about every block as it is, in the place of the last answer if that was about as many samples. */
static void reschedule(const struct lull_host_blocks *blocks, struct lull_host_block *b, unsigned others, uint64_t first_spp)
{
    const int judged = b->reason == LULL_REASON_CRITERION || b->reason == LULL_REASON_DROPPED;
    const int asks = (others >> PT_ROLE_RULE & 1) && b->checks > 0;
    if (judged && (asks || b->spp < blocks->spp_min))
        b->reason = LULL_REASON_NONE;
    if (b->reason != LULL_REASON_NONE)
        return;
    if (b->checks == 0)
        b->next_spp = first_spp;
    else if (asks || judged)
        b->next_spp = b->spp;
    if (b->next_spp == b->spp && b->asked_spp == b->spp) {
        b->checks -= b->checks > 0;
        b->stop_votes -= b->stop_votes > 0;
    }
    if (b->next_spp < blocks->spp_min)
        b->next_spp = blocks->spp_min;
    if (b->next_spp < b->spp)
        b->next_spp = b->spp;
}

void pt_render_go_on(struct pt_render *r, unsigned others, uint64_t first_spp)
{
    struct lull_host_blocks *blocks = r->blocks;
    for (uint32_t i = 0; i < blocks->count; i++) /* no state holds half_spp */
        set_spp(r, &blocks->list[i], blocks->list[i].spp);
    lull_host_extend(blocks);
    for (uint32_t i = 0; (others & ~(1u << PT_ROLE_END)) && i < blocks->count && !r->config.uniform; i++)
        reschedule(blocks, &blocks->list[i], others, first_spp);
    if ((others >> PT_ROLE_LIMIT & 1) && r->config.max_seam >= 1.0)
        lull_host_reopen(blocks, r->config.max_seam);
}

/* Samples up to which a block goes now. */
static uint64_t goal(const struct pt_render *r, const struct lull_host_block *b)
{
    uint64_t most = r->config.pilot_spp, end = b->next_spp;
    if (end > r->blocks->spp_max)
        end = r->blocks->spp_max;
    return most > 0 && end > most ? most : end;
}

static int octave_of(uint64_t spp)
{
    int octave = 0;
    for (uint64_t n = spp / LEAD_SPP; n > 1; n /= 2)
        octave++;
    return octave;
}

static int by_turn(const void *a, const void *b)
{
    const struct pt_render_candidate *x = a, *y = b;
    if (x->octave != y->octave)
        return (x->octave > y->octave) - (x->octave < y->octave);
    if (x->left_s != y->left_s)
        return (x->left_s < y->left_s) - (x->left_s > y->left_s);
    return (x->block > y->block) - (x->block < y->block);
}

/* The blocks that have not reached their next check, whose turn it is first. */
static uint32_t list_candidates(struct pt_render *r)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        uint64_t end = goal(r, b);
        if (b->reason != LULL_REASON_NONE || b->spp >= end)
            continue;
        double per_spp_s = b->spp > 0 ? b->thread_s / (double)b->spp : 0.0, left = (double)(end - b->spp);
        r->work.candidates[n++] =
            (struct pt_render_candidate){i, octave_of(b->spp), left * (per_spp_s > 0.0 ? per_spp_s : 1.0), per_spp_s};
    }
    qsort(r->work.candidates, n, sizeof r->work.candidates[0], by_turn);
    return n;
}

static void shuffle(struct pt_render_work *w, uint32_t state)
{
    for (size_t i = w->count; i > 1; i--) {
        state = state * 1664525u + 1013904223u; /* Numerical Recipes' quick generator: any order will do */
        const struct pt_row swap = w->items[i - 1];
        struct pt_row *other = &w->items[state % i];
        w->items[i - 1] = *other;
        *other = swap;
    }
}

static void list_block(struct pt_render *r, const struct pt_render_candidate *c, double step)
{
    struct pt_render_work *w = &r->work;
    const struct lull_host_block *b = &r->blocks->list[c->block];
    uint64_t end = goal(r, b), most = b->spp > LEAD_SPP ? b->spp : LEAD_SPP;
    most = step < (double)most ? (uint64_t)fmax(step, 1.0) : most;
    uint64_t to = end - b->spp > most ? b->spp + most : end;
    for (int y = b->y0; y < b->y1; y++)
        w->items[w->count++] = (struct pt_row){
            .block = c->block, .y = y, .x0 = b->x0, .x1 = b->x1, .from = (uint32_t)b->spp, .to = (uint32_t)to};
}

/* Lists rows worth span_s wall seconds. Returns how many, 0 when every block is at its check. */
static size_t list_items(struct pt_render *r, double span_s)
{
    struct pt_render_work *w = &r->work;
    double threads = pt_render_threads(r), rows = 0.0, per_spp_s = 0.0;
    const double enough = threads * ROWS_PER_THREAD * fmax(1.0, ROW_PIXELS / r->config.block_width);
    uint32_t chosen = 0, n = list_candidates(r);
    int known = 1;
    while (chosen < n && rows < enough) {
        const struct pt_render_candidate *c = &w->candidates[chosen++];
        rows += r->blocks->list[c->block].y1 - r->blocks->list[c->block].y0;
        per_spp_s += c->per_spp_s;
        known &= c->per_spp_s > 0.0;
    }
    /* All of them get what fits into the span; of blocks whose time is not known one sample tells it. */
    double busy = r->busy_threads > 0.0 ? r->busy_threads : threads;
    w->count = 0;
    for (uint32_t k = 0; k < chosen; k++)
        list_block(r, &w->candidates[k], known ? span_s * busy / per_spp_s : 1.0);
    if (r->config.order_seed != 0)
        shuffle(w, r->config.order_seed);
    return w->count;
}

/* Returns the thread seconds of the slice. */
static double gather(struct pt_render *r)
{
    const struct pt_render_work *w = &r->work;
    double thread_s = 0.0;
    for (size_t k = 0; k < w->count; k++) {
        const struct pt_row *item = &w->items[k];
        struct lull_host_block *b = &r->blocks->list[item->block];
        b->rays += item->rays;
        b->thread_s += item->thread_s;
        thread_s += item->thread_s;
        b->dropped += item->dropped;
        if (item->y == b->y1 - 1)
            set_spp(r, b, item->to);
        r->totals->samples += item->samples;
        r->totals->paths += item->samples;
        r->totals->rays += item->rays;
        r->totals->dropped += item->dropped;
        if (item->dropped > 0)
            lull_host_drop(r->frame, item->first_x, (uint32_t)item->y, item->first_sample);
    }
    return thread_s;
}

static double recent(double before, double now) { return before > 0.0 ? 0.7 * before + 0.3 * now : now; }

/* Samples about SLICE_S worth, less when the time budget ends sooner. *more is 0 when every block is at its check. After a
 * failure, as when it was interrupted on the way, everything is as before. */
static int slice(struct pt_render *r, int *more, struct base_err *err)
{
    double span_s = fmin(SLICE_S + SLICE_PER_WORKER_S * job_worker_threads(r->config.job), LONGEST_SLICE_S);
    if (r->config.time_budget_s > 0.0)
        span_s = fmax(0.01, fmin(span_s, r->config.time_budget_s - lull_host_elapsed_s(r->frame)));
    *more = list_items(r, span_s) > 0;
    if (!*more)
        return 0;
    const struct pt_farm_slice rows = {{r->scene, r->kernel, &r->config.integrator}, &r->film, r->work.items, r->work.count};
    uint64_t before = r->totals->samples;
    double start_s = base_clock_wall_s();
    int rc = pt_farm_sample(r->config.job, r->threads, &rows, err);
    double wall_s = base_clock_wall_s() - start_s;
    r->totals->render_s += wall_s;
    if (rc)
        return rc == JOB_STOPPED ? 0 : rc;
    double thread_s = gather(r);
    r->samples_per_s = recent(r->samples_per_s, (double)(r->totals->samples - before) / fmax(wall_s, 1e-6));
    r->busy_threads = recent(r->busy_threads, thread_s / fmax(wall_s, 1e-6));
    r->sampled_rows = (long)r->work.count;
    return 0;
}

/* A criterion that fails says so once. */
static void warn_once(const struct pt_render *r, const struct pt_render_hooks *hooks, const char *line)
{
    if (r->totals->failed_checks == 1)
        base_log_say(hooks->log, "%s", line);
}

/* Asks about the `count` blocks of work->due. A criterion that fails leaves every decision undecided. */
static void ask(struct pt_render *r, uint32_t count, const struct pt_render_hooks *hooks)
{
    const struct pt_render_work *w = &r->work;
    struct lull_error e = {.struct_size = sizeof e};
    if (lull_host_ask(r->frame, &r->shown.view, w->due, w->final, count, w->decisions, &e) != LULL_OK)
        warn_once(r, hooks, e.message);
}

/* All active blocks are at their next check. */
static int check(struct pt_render *r, const struct pt_render_hooks *hooks, struct base_err *err)
{
    struct pt_render_work *w = &r->work;
    const uint32_t n = lull_host_due(r->frame, w->due, w->final);
    if (n == 0)
        return 0;
    ask(r, n, hooks);
    if (hooks->quote)
        lull_host_quote_ask(hooks->quote, &r->shown.view, w->due, n);
    const int rc = hooks->looked ? hooks->looked(hooks->data, r, n, err) : 0;
    if (!rc)
        lull_host_apply(r->frame, w->due, n, w->decisions);
    return rc;
}

static int suspend(struct pt_render *r, const struct pt_render_hooks *hooks, int reason, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    int rc = hooks->suspend ? hooks->suspend(hooks->data, r, err) : 0;
    if (lull_host_stop(r->frame, reason, &r->shown.view, &e) != LULL_OK)
        warn_once(r, hooks, e.message);
    return rc;
}

/* Who is left has a second to live: first things first, and the criterion is not asked. */
static int lost(struct pt_render *r, const struct pt_render_hooks *hooks, const struct base_err *why, struct base_err *err)
{
    int rc = hooks->suspend ? hooks->suspend(hooks->data, r, err) : 0;
    base_log_say(hooks->log, "%s", why->text);
    lull_host_stop(r->frame, LULL_REASON_INTERRUPT, NULL, NULL);
    return rc;
}

/* A block of this wave has the samples of a pilot before it is at its check. */
static int pilot_is_over(const struct pt_render *r)
{
    int held = 0;
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        held |= b->reason == LULL_REASON_NONE && b->spp < b->next_spp && b->spp < r->blocks->spp_max;
    }
    return held;
}

/* Every active block has all the samples that it may get. */
static int is_whole(const struct pt_render *r)
{
    int whole = 1;
    for (uint32_t i = 0; i < r->blocks->count; i++)
        whole &= r->blocks->list[i].reason != LULL_REASON_NONE || r->blocks->list[i].spp >= r->blocks->spp_max;
    return whole;
}

enum kept { NOT_KEPT, KEPT, NOT_TO_KEEP };

/* A picture that is whole can be gone on with under other limits. */
static void keep(struct pt_render *r, const struct pt_render_hooks *hooks, enum kept *kept, struct base_err *err)
{
    if (*kept == NOT_KEPT && hooks->suspend)
        *kept = hooks->suspend(hooks->data, r, err) == 0 ? KEPT : NOT_TO_KEEP;
}

/* The wave is sampled: asks about its blocks. */
static int end_wave(struct pt_render *r, const struct pt_render_hooks *hooks, enum kept *kept, struct base_err *err)
{
    if (is_whole(r))
        keep(r, hooks, kept, err);
    const int rc = check(r, hooks, err);
    if (rc)
        return rc;
    if (r->config.max_seam >= 1.0)
        lull_host_reopen(r->blocks, r->config.max_seam);
    if (lull_host_active(r->blocks) > 0 && *kept == KEPT)
        *kept = NOT_KEPT;
    return 0;
}

int pt_render_run(struct pt_render *r, const struct pt_render_hooks *hooks, enum pt_render_outcome *outcome,
                  struct base_err *err)
{
    struct base_err why = {0};
    int rc = 0, more = 0;
    enum kept kept = NOT_KEPT;
    *outcome = PT_RENDER_DONE;
    while (lull_host_active(r->blocks) > 0) {
        /* Limits are looked at between slices, not waves: a wave of a large frame can take minutes. */
        int given_up = slice(r, &more, &why);
        if (!given_up && !more) {
            if (pilot_is_over(r)) {
                *outcome = PT_RENDER_PILOT;
                break;
            }
            if ((rc = end_wave(r, hooks, &kept, err)) != 0)
                break;
            continue;
        }
        if (given_up < 0) {
            *outcome = PT_RENDER_LOST;
            rc = lost(r, hooks, &why, err);
            break;
        }
        if (hooks->slice && (rc = hooks->slice(hooks->data, r, err)) != 0)
            break;
        if (hooks->interrupted && *hooks->interrupted) {
            *outcome = PT_RENDER_INTERRUPTED;
            rc = suspend(r, hooks, LULL_REASON_INTERRUPT, err);
            break;
        }
        if (lull_host_out_of_time(r->frame)) {
            *outcome = PT_RENDER_OUT_OF_TIME;
            rc = suspend(r, hooks, LULL_REASON_TIME, err);
            break;
        }
        if (r->config.pilot_spp > 0 && lull_host_elapsed_s(r->frame) >= r->config.pilot_s) {
            *outcome = PT_RENDER_PILOT;
            break;
        }
    }
    if (!rc && *outcome == PT_RENDER_DONE)
        keep(r, hooks, &kept, err);
    return kept == NOT_TO_KEEP && !rc ? err->code : rc;
}

int pt_render_advance(struct pt_render *r, uint64_t spp, const struct pt_render_hooks *hooks, int *stopped,
                      struct base_err *err)
{
    for (uint32_t i = 0; i < r->blocks->count && spp > 0; i++)
        r->blocks->list[i].next_spp = spp;
    for (;;) {
        int more = 0, rc = slice(r, &more, err);
        if (rc || !more)
            return rc;
        rc = hooks->slice ? hooks->slice(hooks->data, r, err) : 0;
        if (rc)
            return rc;
        if (hooks->interrupted && *hooks->interrupted) {
            *stopped = 1;
            return 0;
        }
    }
}

uint32_t pt_render_judge(struct pt_render *r, const struct pt_render_hooks *hooks)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        if (b->asked && b->asked_spp == b->spp)
            continue;
        r->work.due[n] = i;
        r->work.final[n++] = 0;
    }
    if (r->criterion && n > 0) {
        ask(r, n, hooks);
        lull_host_note(r->frame, r->work.due, n, r->work.decisions);
    }
    return n;
}
