/* What accuracy will cost, from the first checks of a render. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <lull/criterion_kit.h>

#include "base/clock.h"
#include "host/frame.h"
#include "sequence/tail.h"

static int32_t no_memory(struct lull_error *err) { return lull_host_no_memory(err, "quote"); }

int32_t lull_host_quote_begin(const struct lull_host_frame *frame, int32_t threads, struct lull_host_quote **out,
                              struct lull_error *err)
{
    int32_t code = lull_host_given(err, "frame", frame, "out", out, NULL);
    if (code != LULL_OK)
        return code;
    if (threads < 1)
        return lull_error_set(err, LULL_E_INVALID, "%d threads: expected at least 1", threads);
    struct lull_host_quote *q = calloc(1, sizeof *q);
    if (!q)
        return no_memory(err);
    q->frame = frame;
    q->threads = threads;
    *out = q;
    return LULL_OK;
}

void lull_host_quote_end(struct lull_host_quote *q)
{
    if (!q)
        return;
    for (uint32_t i = 0; i < q->count; i++) {
        lull_host_close(q->asked[i].criterion);
        free(q->asked[i].responses);
        free(q->asked[i].blocks);
    }
    free(q->asked);
    free(q->rows);
    free(q);
}

/* The new row is the last one, even after a failure, so that it is freed. */
static int32_t add_row(struct lull_host_quote *q, struct lull_error *err)
{
    const size_t n = q->frame->blocks.count;
    struct lull_host_quote_asked *grown = realloc(q->asked, (q->count + 1) * sizeof *grown);
    if (!grown)
        return no_memory(err);
    struct lull_host_quote_asked *a = &grown[q->count++];
    *a =
        (struct lull_host_quote_asked){.responses = calloc(n, sizeof *a->responses), .blocks = calloc(n, sizeof *a->blocks)};
    q->asked = grown;
    return a->responses && a->blocks ? LULL_OK : no_memory(err);
}

/* `error` counts instead of `visible`: of the two only one is set. */
static int excludes(const char *one, const char *other)
{
    return (strcmp(one, "error") == 0 && strcmp(other, "visible") == 0) ||
           (strcmp(one, "visible") == 0 && strcmp(other, "error") == 0);
}

/* The frame's criterion once more, with a parameter changed; NULL: with none. */
static int32_t create_changed(const struct lull_host_criterion *own, const struct lull_pair *changed,
                              struct lull_host_criterion **made, struct lull_error *err)
{
    struct lull_host_services services = own->offered;
    struct lull_pair *pairs = calloc((size_t)own->pair_count + 1, sizeof *pairs);
    uint32_t count = 0;
    if (!pairs)
        return no_memory(err);
    services.struct_size = sizeof services;
    services.release = NULL; /* the context is the frame's criterion's */
    for (uint32_t i = 0; i < own->pair_count; i++)
        if (!changed || !excludes(changed->key, own->pairs[i].key))
            pairs[count++] = own->pairs[i];
    if (changed)
        pairs[count++] = *changed; /* a later pair wins */
    const int32_t code = lull_host_create(&services, own->table, pairs, count, made, err);
    free(pairs);
    return code;
}

int32_t lull_host_quote_add(struct lull_host_quote *q, const struct lull_pair *changed, int32_t asked,
                            struct lull_error *err)
{
    int32_t code = lull_host_given(err, "quote", q, NULL);
    if (code == LULL_OK)
        code = lull_host_check_pairs(changed, changed != NULL, err);
    if (code == LULL_OK)
        code = add_row(q, err);
    if (code != LULL_OK)
        return code;
    struct lull_host_quote_asked *a = &q->asked[q->count - 1];
    a->itself = asked;
    if (!q->frame->criterion)
        return LULL_OK;
    code = create_changed(q->frame->criterion, changed, &a->criterion, err);
    return code == LULL_OK ? lull_host_join(q->frame, a->criterion, err) : code;
}

/* Samples at the first check of the frame's criterion if it stopped at this error: drafts may be checked earlier. */
static uint64_t first_check(const struct lull_host_criterion *own, double limit)
{
    struct lull_host_criterion *made = NULL;
    char text[32];
    const struct lull_pair error = {"error", text};
    if (!own || !lull_host_number(limit, text) || create_changed(own, &error, &made, NULL) != LULL_OK)
        return own ? own->needs.first_spp : 1;
    const uint64_t first = made->needs.first_spp;
    lull_host_close(made);
    return first;
}

int32_t lull_host_quote_add_error(struct lull_host_quote *q, double limit, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "quote", q, NULL);
    if (code == LULL_OK && !(limit > 0.0 && limit < INFINITY))
        code = lull_error_set(err, LULL_E_INVALID, "an error of %g: expected more than 0", limit);
    if (code == LULL_OK)
        code = add_row(q, err);
    if (code != LULL_OK)
        return code;
    struct lull_host_quote_asked *a = &q->asked[q->count - 1];
    a->limit = limit;
    a->first_spp = first_check(q->frame->criterion, limit);
    return LULL_OK;
}

int32_t lull_host_quote_add_other(struct lull_host_quote *q, struct lull_host_criterion *criterion, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "quote", q, "criterion", criterion, NULL);
    if (code == LULL_OK)
        code = add_row(q, err);
    if (code != LULL_OK) {
        lull_host_close(criterion);
        return code;
    }
    q->asked[q->count - 1].criterion = criterion;
    q->asked[q->count - 1].other = 1;
    return lull_host_join(q->frame, criterion, err);
}

static void note(struct lull_host_responses *r, struct lull_host_response response)
{
    r->last = response;
    r->first = r->first.spp > 0 ? r->first : response;
}

/* A row that would have stopped the block at an earlier check has stopped it; where between the two checks follows from what
 * it expected at the first. */
static void note_answer(struct lull_host_responses *r, const struct lull_host_block *b, const struct lull_decision *d,
                        uint64_t spp_min)
{
    const struct lull_host_response *before = &r->last;
    struct lull_host_response response = {.spp = b->spp, .predicted = d->predicted_spp};
    if (before->stopped || b->spp <= before->spp)
        return;
    if (d->action == LULL_STOP && b->spp >= spp_min) {
        double expected = before->spp > 0 && isfinite(before->predicted) ? before->predicted : (double)b->spp;
        double stop = fmin(fmax(expected, (double)before->spp), (double)b->spp);
        response = (struct lull_host_response){.spp = b->spp, .predicted = fmax(stop, (double)spp_min), .stopped = 1};
    }
    note(r, response);
}

/* Errors fall by half an octave for each of the samples where they are noise, slower where they are a denoiser's. */
static const double LEAST_FALL = 0.25, FALL_OF_NOISE = 0.5;

/* A row by error: between two checks, and beyond the last, the error is a power of the samples. */
static void note_error(struct lull_host_quote_asked *a, uint32_t index, const struct lull_host_block *b, double error,
                       uint64_t spp_min)
{
    const struct lull_host_response *response = &a->responses[index].last;
    if (response->stopped || b->spp <= response->spp)
        return;
    const double spp = (double)b->spp, before = response->error, limit = a->limit * lull_host_mask_factor(b->step);
    const int has_before = response->spp > 0 && before > 0.0;
    double fall = FALL_OF_NOISE;
    if (has_before && error > 0.0)
        fall = fmin(fmax(log2(before / error) / log2(spp / (double)response->spp), LEAST_FALL), FALL_OF_NOISE);
    double stop = error > 0.0 ? spp * pow(error / limit, 1.0 / fall) : isnan(error) ? (double)NAN : 0.0;
    const int stopped = error <= limit && b->spp >= spp_min;
    const double first = fmin((double)a->first_spp, spp); /* 0: there were checks before the quote began */
    const double least = has_before ? (double)response->spp : b->checks > 1 ? 0.0 : first;
    if (stopped)
        stop = fmax(fmin(fmax(stop, least), spp), (double)spp_min);
    note(&a->responses[index],
         (struct lull_host_response){.spp = b->spp, .predicted = stop, .error = error, .stopped = stopped});
}

static void note_errors(const struct lull_host_quote *q, const uint32_t *due, uint32_t count,
                        const struct lull_decision *decisions)
{
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    for (uint32_t i = 0; i < q->count; i++)
        for (uint32_t k = 0; k < count && q->asked[i].limit > 0.0; k++)
            note_error(&q->asked[i], due[k], &blocks->list[due[k]], decisions[k].error, blocks->spp_min);
}

static int32_t ask_row(const struct lull_host_quote *q, struct lull_host_quote_asked *a, const struct lull_host_view *view,
                       const uint32_t *due, uint32_t count, struct lull_error *err)
{
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    if (!a->criterion || count == 0 || (blocks->flags & LULL_HOST_UNIFORM))
        return LULL_OK;
    struct lull_decision *decisions = calloc(count, sizeof *decisions + 1);
    if (!decisions)
        return no_memory(err);
    uint8_t *final = memset(decisions + count, 1, count); /* the answers are read, and followed by no sample */
    double start_s = base_clock_wall_s();
    int32_t code = lull_host_evaluate(a->criterion, q->frame, view, due, final, count, decisions, err);
    a->asked_s += base_clock_wall_s() - start_s;
    a->count += count;
    for (uint32_t k = 0; k < count && code == LULL_OK; k++)
        note_answer(&a->responses[due[k]], &blocks->list[due[k]], &decisions[k], blocks->spp_min);
    if (code == LULL_OK && a->itself)
        note_errors(q, due, count, decisions);
    free(decisions);
    return code;
}

void lull_host_quote_ask(struct lull_host_quote *q, const struct lull_host_view *view, const uint32_t *due, uint32_t count)
{
    for (uint32_t i = 0; i < q->count; i++)
        ask_row(q, &q->asked[i], view, due, count, NULL);
}

/* One pixel in a hundred with more than this share of the squared difference of the halves (8 % in normal noise) … */
static const double MOST_TOP_SHARE = 0.6;
/* … or predicted samples that grow by half as many octaves as the samples do: noise that more samples find more of. */
static const double GROWTH = 0.5;

/* Of the halves' luminance difference, where what is no number is 0; 0 without halves. scratch: [pixels of the block] */
static double top_share(const struct lull_host_frame *f, const struct lull_view *view, uint32_t index, double *scratch)
{
    const struct lull_block b =
        lull_host_state_of(&f->blocks.list[index], index, lull_kit_plane(view, LULL_PLANE_HALF) != NULL);
    const double *weights = f->config.rgb_to_xyz + 3; /* what makes luminance of colours */
    size_t n = 0;
    struct lull_kit_span s;
    if (b.half_spp == 0 || b.half_spp == b.spp)
        return 0.0;
    lull_kit_span_begin(&s, view, &b, LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF));
    while (lull_kit_span_next(&s))
        for (int32_t i = 0; i < s.count; i++) {
            double d = 0.0;
            for (int c = 0; c < 3; c++)
                d += weights[c] * (s.value[LULL_PLANE_HALF][i][c] - s.value[LULL_PLANE_COLOR][i][c]);
            scratch[n++] = isfinite(d) ? fabs(d) : 0.0;
        }
    return seq_tail_of(scratch, n, 0.0).top_share;
}

static int grows(const struct lull_host_responses *r)
{
    return r->first.spp > 0 && r->last.spp > r->first.spp &&
           log2(r->last.predicted / r->first.predicted) > GROWTH * log2((double)r->last.spp / (double)r->first.spp);
}

static size_t pixels_of(const struct lull_host_block *b) { return (size_t)(b->x1 - b->x0) * (size_t)(b->y1 - b->y0); }

static int32_t find_undersampled(const struct lull_host_quote *q, const struct lull_host_view *view, struct lull_error *err)
{
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    struct lull_host_shown shown;
    size_t most = 0;
    for (uint32_t i = 0; i < blocks->count; i++)
        most = pixels_of(&blocks->list[i]) > most ? pixels_of(&blocks->list[i]) : most;
    double *scratch = malloc(most * sizeof *scratch);
    if (!scratch)
        return no_memory(err);
    int32_t code = lull_host_show(blocks, view, 0, &shown, err);
    for (uint32_t i = 0; i < blocks->count && code == LULL_OK; i++) {
        int tail = top_share(q->frame, &shown.view, i, scratch) > MOST_TOP_SHARE;
        for (uint32_t k = 0; k < q->count; k++) {
            struct lull_host_responses *r = &q->asked[k].responses[i];
            r->last.undersampled = r->last.spp > 0 && !r->last.stopped && (tail || grows(r));
        }
    }
    if (code == LULL_OK)
        lull_host_hide(&shown);
    free(scratch);
    return code;
}

/* Thread seconds of one sample of every pixel of each block; blocks that have none take the mean of the rest. */
static void cost_blocks(const struct lull_host_blocks *blocks, struct lull_host_quote_block *out)
{
    double thread_s = 0.0, samples = 0.0;
    for (uint32_t i = 0; i < blocks->count; i++) {
        thread_s += blocks->list[i].thread_s;
        samples += (double)blocks->list[i].spp * (double)pixels_of(&blocks->list[i]);
    }
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        out[i].sample_s = b->spp > 0 ? b->thread_s / (double)b->spp : (double)pixels_of(b) * thread_s / samples;
    }
}

static double wall_s(const struct lull_host_quote *q, const struct lull_host_quote_asked *a, int which,
                     struct lull_host_work *work)
{
    const double check_s = a->other && a->count > 0 ? a->asked_s / (double)a->count : q->check_s;
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    double checks = 0.0;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct lull_host_block *b = &blocks->list[i];
        const struct lull_host_stop_at *stop = &a->blocks[i].stop;
        const double spp[3] = {stop->spp, stop->low, stop->high};
        work[i] = (struct lull_host_work){spp[which], spp[which] * a->blocks[i].sample_s, b->y1 - b->y0};
        checks += blocks->flags & LULL_HOST_UNIFORM ? 0.0 : (double)b->checks + lull_host_expect_checks(b, spp[which]);
    }
    return lull_host_wall_s(work, blocks->count, q->threads) + checks * check_s;
}

/* The render's own blocks are where they are; another row's may have stopped before, or would go on. */
static struct lull_host_stop_at stop_of(const struct lull_host_blocks *blocks, const struct lull_host_block *b,
                                        struct lull_host_response response, int asked)
{
    if (blocks->flags & LULL_HOST_UNIFORM)
        return lull_host_expect_block(blocks, b);
    if (!asked)
        return lull_host_expect(&response, 0, blocks->spp_max);
    if (b->reason == LULL_REASON_CRITERION || b->reason == LULL_REASON_SPP_MAX || b->reason == LULL_REASON_DROPPED)
        return lull_host_expect_block(blocks, b);
    if (response.stopped)
        response.predicted = (double)b->next_spp;
    return lull_host_expect(&response, lull_host_goal(blocks, b), blocks->spp_max);
}

/* Light that most pixels have not met tells what it needs from a hundred samples on: of 24 scenes quoted at 20, 32 and 64
 * samples, those off by more than 1.6 had more than half of their samples in such blocks (docs/results/quote.md). What has
 * not been judged yet tells nothing. */
static const double ENOUGH = 100.0, MOST_SILENT = 0.5;

static int tells_nothing(const struct lull_host_quote *q, const struct lull_host_quote_asked *a, uint32_t i)
{
    const struct lull_host_block *b = &q->frame->blocks.list[i];
    const struct lull_host_criterion *judge = a->criterion ? a->criterion : q->frame->criterion;
    const struct lull_host_quote_block *said = &a->blocks[i];
    return said->stop.known ? said->unmet && (double)a->responses[i].last.spp < ENOUGH
                            : judge && b->spp < judge->needs.first_spp && b->spp < q->frame->blocks.spp_max;
}

static void add_up(const struct lull_host_quote *q, const struct lull_host_quote_asked *a, struct lull_host_quote_row *row,
                   struct lull_host_work *work)
{
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    double pixels = 0.0, silent = 0.0;
    *row = (struct lull_host_quote_row){.blocks = a->blocks,
                                        .asked = a->itself,
                                        .spp_min = INFINITY,
                                        .parameter = a->parameter,
                                        .value = a->value,
                                        .name = a->name};
    cost_blocks(blocks, a->blocks);
    for (uint32_t i = 0; i < blocks->count; i++) {
        struct lull_host_quote_block *to = &a->blocks[i];
        const struct lull_host_stop_at stop = stop_of(blocks, &blocks->list[i], a->responses[i].last, a->itself);
        const double size = (double)pixels_of(&blocks->list[i]), cost_s = to->sample_s;
        *to = (struct lull_host_quote_block){
            stop, stop.spp * cost_s, stop.low * cost_s, stop.high * cost_s, cost_s, a->responses[i].last.undersampled};
        row->thread_s += to->thread_s;
        row->thread_low_s += to->thread_low_s;
        row->thread_high_s += to->thread_high_s;
        row->spp_mean += size * stop.spp;
        row->spp_mean_low += size * stop.low;
        row->spp_mean_high += size * stop.high;
        row->spp_min = fmin(row->spp_min, stop.spp);
        row->spp_max = fmax(row->spp_max, stop.spp);
        row->unknown += (uint32_t)!stop.known;
        row->unmet += (uint32_t)to->unmet;
        row->capped += (uint32_t)(!(blocks->flags & LULL_HOST_UNIFORM) && stop.spp >= (double)blocks->spp_max);
        silent += tells_nothing(q, a, i) ? size * stop.spp : 0.0;
        pixels += size;
    }
    row->told = silent <= MOST_SILENT * row->spp_mean;
    row->spp_mean /= pixels;
    row->spp_mean_low /= pixels;
    row->spp_mean_high /= pixels;
    row->against_uniform = row->spp_mean / row->spp_max;
    row->wall_s = wall_s(q, a, 0, work);
    row->wall_low_s = wall_s(q, a, 1, work);
    row->wall_high_s = wall_s(q, a, 2, work);
}

int32_t lull_host_quote_finish(struct lull_host_quote *q, const struct lull_host_view *view,
                               const struct lull_host_quote_row **rows, uint32_t *count, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "quote", q, "view", view, "rows", rows, "count", count, NULL);
    if (code != LULL_OK)
        return code;
    const struct lull_host_totals *totals = &q->frame->totals;
    const struct lull_host_blocks *blocks = &q->frame->blocks;
    struct lull_host_work *work = calloc(blocks->count, sizeof *work);
    uint32_t *due = calloc(blocks->count, sizeof *due), n = 0;
    free(q->rows);
    q->rows = calloc(q->count + 1, sizeof *q->rows);
    code = work && due && q->rows ? LULL_OK : no_memory(err);
    for (uint32_t i = 0; i < blocks->count && code == LULL_OK; i++)
        if (blocks->list[i].spp > 0)
            due[n++] = i;
    for (uint32_t i = 0; i < q->count && code == LULL_OK; i++)
        code = ask_row(q, &q->asked[i], view, due, n, err);
    if (code == LULL_OK)
        code = find_undersampled(q, view, err);
    q->check_s = totals->checks > 0 ? totals->criterion_s / (double)totals->checks : 0.0;
    for (uint32_t i = 0; i < q->count && code == LULL_OK; i++)
        add_up(q, &q->asked[i], &q->rows[i], work);
    free(work);
    free(due);
    *rows = q->rows;
    *count = q->count;
    return code;
}

/* Frames of a shot between two quotes: what their blocks need by what the two say. */
static const double FADE = 0.8408964152537145; /* 2^(-1/4) */

/* A block moves when what it needs has changed by more than the quotes may be wrong. */
static int has_moved(const struct lull_host_stop_at *a, const struct lull_host_stop_at *b)
{
    return a->low > b->high || b->low > a->high;
}

uint32_t lull_host_quote_between(const struct lull_host_quote_block *a, const struct lull_host_quote_block *b,
                                 uint32_t count, uint32_t columns, uint32_t block)
{
    const long width = (long)columns, height = (long)count / width, x = (long)block % width, y = (long)block / width;
    const double own = fmax(1.0, fmax(a[block].stop.spp, b[block].stop.spp));
    double most = own;
    for (long v = y > 0 ? y - 1 : 0; v <= y + 1 && v < height; v++)
        for (long u = x > 0 ? x - 1 : 0; u <= x + 1 && u < width; u++) {
            const struct lull_host_stop_at *before = &a[v * width + u].stop, *after = &b[v * width + u].stop;
            if (has_moved(before, after))
                most = fmax(most, fmax(before->spp, after->spp));
        }
    return (uint32_t)ceil(sqrt(own * most));
}

void lull_host_quote_fade(uint32_t *spp, const uint32_t *beside, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t least = (uint32_t)ceil(FADE * beside[i]);
        if (spp[i] < least)
            spp[i] = least;
    }
}
