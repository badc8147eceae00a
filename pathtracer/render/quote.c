#include "render/quote.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "render/host.h"
#include "sequence/tail.h"

/* --- rows -------------------------------------------------------------------------------------------------------------- */

static int add_row(struct pt_quote *q, double visible, const char *name, int asked, struct base_err *err)
{
    struct pt_quote_row *row = &q->rows[q->row_count++];
    row->name = name;
    row->visible = visible;
    row->asked = asked;
    row->said = calloc(q->block_count, sizeof *row->said);
    row->first = calloc(q->block_count, sizeof *row->first);
    row->blocks = calloc(q->block_count, sizeof *row->blocks);
    return row->said && row->first && row->blocks ? 0 : base_fail_nomem(err, "quote");
}

/* The row's own instance: the given parameters, and its share of viewers after them, which wins. */
static int open_row(struct pt_quote_row *row, const struct pt_render *r, const struct lull_criterion *table,
                    const struct lull_pair *pairs, uint32_t pair_count, struct base_log *log, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    char value[32];
    uint32_t n = pair_count;
    struct lull_pair *all = calloc((size_t)pair_count + 1, sizeof *all);
    if (!all)
        return base_fail_nomem(err, "quote");
    for (uint32_t i = 0; i < pair_count; i++)
        all[i] = pairs[i];
    if (!isnan(row->visible)) {
        snprintf(value, sizeof value, "%.17g", row->visible);
        all[n++] = (struct lull_pair){"visible", value};
    }
    int rc = pt_criterion_create(table, all, n, r->threads, log, &row->criterion, err);
    free(all);
    int32_t code = rc ? LULL_OK : lull_host_join(r->frame, row->criterion, &e);
    return code == LULL_OK ? rc : pt_host_fail(code, &e, err);
}

/* Rows by falling share, the one that the options ask for among them; its share is NaN, and it comes first, when the
 * criterion has no such parameter or no value for it. */
static int add_rows(struct pt_quote *q, const struct lull_criterion *table, const struct lull_pair *pairs,
                    uint32_t pair_count, struct base_err *err)
{
    struct {
        double visible;
        const char *name;
    } shares[] = {{0.5, "draft"}, {0.25, "default"}, {0.05, "final"}};
    const struct lull_param *parameter = NULL;
    const char *text = table ? lull_host_parameter(table, "visible", pairs, pair_count, &parameter) : NULL;
    double asked;
    int met = !text || !base_parse_real(text, 0, 1, &asked);
    int rc = met ? add_row(q, (double)NAN, "as asked", 1, err) : 0;
    if (!parameter || rc)
        return rc;
    if (met)
        asked = -1.0;
    if (!base_parse_real(parameter->default_value, 0.05, 0.5, &shares[1].visible)) /* a model's own */
        shares[1].name = "normal";
    for (size_t i = 0; i < sizeof shares / sizeof shares[0] && !rc; i++) {
        const double share = shares[i].visible;
        if (!met && asked > share)
            rc = add_row(q, asked, "as asked", met = 1, err);
        met |= asked == share;
        if (!rc)
            rc = add_row(q, share, shares[i].name, asked == share, err);
    }
    return rc || met ? rc : add_row(q, asked, "as asked", 1, err);
}

/* The two pictures, as asked: rows for other shares would denoise each block once more. */
static int add_pictures(struct pt_quote *q, const struct lull_criterion *table, const struct lull_pair *pairs,
                        uint32_t pair_count, struct base_err *err)
{
    const char *text = lull_host_parameter(table, "visible", pairs, pair_count, NULL);
    double asked;
    if (!text || !base_parse_real(text, 0, 1, &asked))
        asked = (double)NAN;
    int rc = add_row(q, asked, "denoised", 1, err);
    return rc ? rc : add_row(q, asked, "noisy", 0, err);
}

int pt_quote_create(const struct pt_render *r, const struct lull_criterion *table, const struct lull_pair *pairs,
                    uint32_t pair_count, const struct lull_criterion *noisy, struct base_log *log, struct pt_quote **out,
                    struct base_err *err)
{
    struct pt_quote *q = calloc(1, sizeof *q);
    if (!q)
        return base_fail_nomem(err, "quote");
    q->block_count = r->blocks->count;
    q->threads = pt_render_threads(r);
    q->block_cost_s = calloc(q->block_count, sizeof *q->block_cost_s);
    int rc = !q->block_cost_s ? base_fail_nomem(err, "quote")
             : noisy          ? add_pictures(q, table, pairs, pair_count, err)
                              : add_rows(q, table, pairs, pair_count, err);
    for (int i = 0; i < q->row_count && table && !rc; i++)
        rc = noisy && i == 1 ? open_row(&q->rows[i], r, noisy, NULL, 0, log, err)
                             : open_row(&q->rows[i], r, table, pairs, pair_count, log, err);
    if (rc) {
        pt_quote_destroy(q);
        return rc;
    }
    *out = q;
    return 0;
}

void pt_quote_destroy(struct pt_quote *q)
{
    if (!q)
        return;
    for (int i = 0; i < q->row_count; i++) {
        lull_host_close(q->rows[i].criterion);
        free(q->rows[i].said);
        free(q->rows[i].first);
        free(q->rows[i].blocks);
    }
    free(q->block_cost_s);
    free(q);
}

/* --- asking ------------------------------------------------------------------------------------------------------------ */

/* A row that would have stopped the block at an earlier check has stopped it; where between the two checks follows from what
 * it expected at the first. */
static void note_answer(struct lull_host_said *said, const struct lull_host_block *b, const struct lull_decision *d,
                        uint64_t spp_min)
{
    if (said->stopped || b->spp <= said->spp)
        return;
    if (d->action == LULL_STOP && b->spp >= spp_min) {
        double expected = said->spp > 0 && isfinite(said->predicted) ? said->predicted : (double)b->spp;
        double stop = fmin(fmax(expected, (double)said->spp), (double)b->spp);
        *said = (struct lull_host_said){.spp = b->spp, .predicted = fmax(stop, (double)spp_min), .stopped = 1};
    } else {
        *said = (struct lull_host_said){.spp = b->spp, .predicted = d->predicted_spp};
    }
}

static int ask_row(struct pt_quote_row *row, struct pt_render *r, const uint32_t *due, uint32_t count, struct base_err *err)
{
    struct lull_decision *decisions = calloc(count, sizeof *decisions);
    uint8_t *final = calloc(count, 1);
    int rc = decisions && final ? 0 : base_fail_nomem(err, "quote");
    if (!rc)
        rc = pt_criterion_evaluate(row->criterion, r->frame, &r->film, due, count, final, decisions, err);
    for (uint32_t k = 0; k < count && !rc; k++)
        note_answer(&row->said[due[k]], &r->blocks->list[due[k]], &decisions[k], r->config.spp_min);
    for (uint32_t k = 0; k < count && !rc; k++)
        if (row->first[due[k]].spp == 0)
            row->first[due[k]] = row->said[due[k]];
    free(decisions);
    free(final);
    return rc;
}

void pt_quote_ask(struct pt_quote *q, struct pt_render *r, const uint32_t *due, uint32_t count)
{
    struct base_err ignored = {0};
    for (int i = 0; i < q->row_count && !r->config.uniform; i++)
        ask_row(&q->rows[i], r, due, count, &ignored);
}

static int ask_all(struct pt_quote *q, struct pt_render *r, struct base_err *err)
{
    uint32_t *due = calloc(q->block_count, sizeof *due), n = 0;
    if (!due)
        return base_fail_nomem(err, "quote");
    for (uint32_t i = 0; i < q->block_count; i++)
        if (r->blocks->list[i].spp > 0)
            due[n++] = i;
    int rc = 0;
    for (int i = 0; i < q->row_count && n > 0 && !r->config.uniform && !rc; i++)
        rc = ask_row(&q->rows[i], r, due, n, err);
    free(due);
    return rc;
}

/* --- light that is rare --- */

/* One pixel in a hundred with more than this share of the squared difference of the halves (8 % in normal noise) … */
static const double MOST_TOP_SHARE = 0.6;
/* … or predicted samples that grow by half as many octaves as the samples do: noise that more samples find more of. */
static const double GROWTH = 0.5;

/* Of the halves' luminance difference, where what is no number is 0; 0 without halves. scratch: [pixels of the block] */
static double top_share(const struct pt_render *r, const struct lull_host_block *b, double *scratch)
{
    size_t n = 0;
    uint64_t half_spp = pt_film_half_spp(b->spp);
    if (!(r->film.planes & PT_FILM_HALF) || half_spp == 0 || half_spp == b->spp)
        return 0.0;
    for (int y = b->y0; y < b->y1; y++)
        for (int x = b->x0; x < b->x1; x++) {
            double m[3], a[3];
            size_t at = pt_film_index(&r->film, x, y);
            pt_film_mean(&r->film, at, b->spp, m);
            pt_film_half_mean(&r->film, at, half_spp, a);
            double d = base_luminance(a[0] - m[0], a[1] - m[1], a[2] - m[2]);
            scratch[n++] = isfinite(d) ? fabs(d) : 0.0;
        }
    return seq_tail_of(scratch, n, 0.0).top_share;
}

static int grows(const struct lull_host_said *first, const struct lull_host_said *said)
{
    return first->spp > 0 && said->spp > first->spp && !said->stopped &&
           log2(said->predicted / first->predicted) > GROWTH * log2((double)said->spp / (double)first->spp);
}

static int find_unmet(struct pt_quote *q, const struct pt_render *r, struct base_err *err)
{
    size_t most = (size_t)r->config.block_width * (size_t)r->config.block_height;
    double *scratch = malloc(most * sizeof *scratch);
    if (!scratch)
        return base_fail_nomem(err, "quote");
    for (uint32_t i = 0; i < q->block_count; i++) {
        int tail = top_share(r, &r->blocks->list[i], scratch) > MOST_TOP_SHARE;
        for (int k = 0; k < q->row_count; k++) {
            struct lull_host_said *said = &q->rows[k].said[i];
            said->unmet = !said->stopped && (tail || grows(&q->rows[k].first[i], said));
        }
    }
    free(scratch);
    return 0;
}

/* --- the answer -------------------------------------------------------------------------------------------------------- */

/* Thread seconds of one sample of every pixel of a block; blocks that have none take the mean of the rest. */
static void cost_blocks(struct pt_quote *q, const struct pt_render *r)
{
    double thread_s = 0.0, samples = 0.0;
    for (uint32_t i = 0; i < q->block_count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        thread_s += b->thread_s;
        samples += (double)b->spp * (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0);
    }
    for (uint32_t i = 0; i < q->block_count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        double pixels = (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0);
        q->block_cost_s[i] = b->spp > 0 ? b->thread_s / (double)b->spp : pixels * thread_s / samples;
    }
}

static double wall_s(const struct pt_quote *q, const struct pt_render *r, const struct pt_quote_row *row, int which,
                     struct lull_host_work *work)
{
    double checks = 0.0;
    for (uint32_t i = 0; i < q->block_count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        const struct pt_quote_block *a = &row->blocks[i];
        const double spp[3] = {a->stop.spp, a->stop.low, a->stop.high};
        work[i] = (struct lull_host_work){spp[which], spp[which] * q->block_cost_s[i], b->y1 - b->y0};
        checks += r->config.uniform ? 0.0 : (double)b->checks + lull_host_expect_checks(b, spp[which]);
    }
    return lull_host_wall_s(work, q->block_count, q->threads) + checks * q->check_s;
}

/* The render's own blocks are where they are; another row's may have stopped before, or would go on. */
static struct lull_host_stop_at stop_of(const struct pt_quote_row *row, const struct pt_render *r, uint32_t i)
{
    const struct lull_host_block *b = &r->blocks->list[i];
    uint64_t most = r->config.spp_max;
    if (r->config.uniform)
        return lull_host_expect_block(r->blocks, b);
    if (!row->asked)
        return lull_host_expect(&row->said[i], 0, most);
    if (b->reason == LULL_REASON_CRITERION || b->reason == LULL_REASON_SPP_MAX || b->reason == LULL_REASON_DROPPED)
        return lull_host_expect_block(r->blocks, b);
    struct lull_host_said said = row->said[i];
    if (said.stopped)
        said.predicted = (double)b->next_spp;
    return lull_host_expect(&said, b->next_spp, most);
}

static void add_up(struct pt_quote *q, const struct pt_render *r, struct pt_quote_row *row, struct lull_host_work *work)
{
    double pixels = 0.0;
    row->spp_min = INFINITY;
    for (uint32_t i = 0; i < q->block_count; i++) {
        const struct lull_host_block *b = &r->blocks->list[i];
        struct pt_quote_block *a = &row->blocks[i];
        double size = (double)(b->x1 - b->x0) * (double)(b->y1 - b->y0), cost_s = q->block_cost_s[i];
        a->stop = stop_of(row, r, i);
        a->thread_s = a->stop.spp * cost_s;
        a->thread_low_s = a->stop.low * cost_s;
        a->thread_high_s = a->stop.high * cost_s;
        row->thread_s += a->thread_s;
        row->spp_mean += size * a->stop.spp;
        row->spp_mean_low += size * a->stop.low;
        row->spp_mean_high += size * a->stop.high;
        row->spp_min = fmin(row->spp_min, a->stop.spp);
        row->spp_max = fmax(row->spp_max, a->stop.spp);
        row->unknown += (uint32_t)!a->stop.known;
        row->unmet += (uint32_t)row->said[i].unmet;
        row->capped += (uint32_t)(!r->config.uniform && a->stop.spp >= (double)r->config.spp_max);
        row->thread_low_s += a->thread_low_s;
        row->thread_high_s += a->thread_high_s;
        pixels += size;
    }
    row->spp_mean /= pixels;
    row->spp_mean_low /= pixels;
    row->spp_mean_high /= pixels;
    row->against_uniform = row->spp_mean / row->spp_max;
    row->wall_s = wall_s(q, r, row, 0, work);
    row->wall_low_s = wall_s(q, r, row, 1, work);
    row->wall_high_s = wall_s(q, r, row, 2, work);
}

int pt_quote_finish(struct pt_quote *q, struct pt_render *r, struct base_err *err)
{
    struct lull_host_work *work = calloc(q->block_count, sizeof *work);
    int rc = work ? ask_all(q, r, err) : base_fail_nomem(err, "quote");
    if (!rc)
        rc = find_unmet(q, r, err);
    cost_blocks(q, r);
    q->check_s = r->totals->checks > 0 ? r->totals->criterion_s / (double)r->totals->checks : 0.0;
    for (int i = 0; i < q->row_count && !rc; i++)
        add_up(q, r, &q->rows[i], work);
    free(work);
    return rc;
}
