/* The prediction behind --quote and the progress line, under a noise whose law is known in closed form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <lull/criterion_kit.h>

#include "host/frame.h"
#include "render/quote.h"
#include "support/approve.h"
#include "support/pt_fake.h"

/* --- a criterion that knows the law ------------------------------------------------------------------------------------ */

/* error = sqrt(40 (1 + column) / n), stopped at 2 visible: at 40 (1 + column) spp for visible = 0.5, at 4 times as many for
 * 0.25, at 100 times as many for 0.05. */
static double law_spp(const struct lull_host_block *b, double visible)
{
    return 40.0 * (1 + b->x0 / 16) * 0.25 / (visible * visible);
}

static const struct lull_param law_params[] = {LULL_KIT_FLOAT("visible", "0.25", 1e-3, 0.999, "share of viewers")};

static void law_judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                      struct lull_decision *d, uint32_t worker)
{
    const struct lull_kit *kit = lull_kit_of(in);
    struct lull_kit_tally tally = {.valid = 1};
    (void)view;
    (void)worker;
    lull_kit_verdict(kit, b, &tally, sqrt(40.0 * (1 + b->x0 / 16) / (double)b->spp), 2 * kit->value[0], 0, 1.5, d);
}

enum { LAW_PLANES = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) };
static const struct lull_kit_rule law_rule = {.planes_required = LAW_PLANES, .planes_used = LAW_PLANES, .judge = law_judge};
LULL_KIT_CRITERION(law_rule, law_params, 1, "law", "Law of noise", "1", "knows");

/* --- running ----------------------------------------------------------------------------------------------------------- */

struct run {
    struct base_threads *pool;
    struct lull_host_criterion *criterion;
    struct pt_render *render;
    struct pt_quote *quote;
    struct lull_pair pair;
};

/* visible NULL: uniform, without a criterion. */
static void start(struct run *run, const char *visible, uint64_t pilot_spp)
{
    struct base_err err = {0};
    struct pt_render_config config = pt_fake_config();
    const struct lull_criterion *table = visible ? lull_criterion_entry_v1(0) : NULL;
    config.spp_max = 10000;
    config.pilot_spp = pilot_spp;
    config.pilot_s = 1e9;
    config.uniform = !visible;
    *run = (struct run){.pair = {"visible", visible}};
    assert_non_null(run->pool = base_threads_create(2, &err));
    if (visible)
        assert_int_equal(pt_criterion_create(table, &run->pair, 1, run->pool, NULL, &run->criterion, &err), 0);
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, run->pool, run->criterion, &run->render, &err), 0);
    if (pilot_spp > 0)
        assert_int_equal(pt_quote_create(run->render, NULL, &run->quote, &err), 0);
}

static enum pt_render_outcome go(struct run *run)
{
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    struct pt_render_hooks hooks = {.quote = run->quote ? run->quote->quote : NULL};
    assert_int_equal(pt_render_run(run->render, &hooks, &outcome, &err), 0);
    return outcome;
}

static void end(struct run *run)
{
    pt_quote_destroy(run->quote);
    pt_render_destroy(run->render);
    lull_host_close(run->criterion);
    base_threads_destroy(run->pool);
}

/* --- tests ------------------------------------------------------------------------------------------------------------- */

/* Rows of 50, 25 and 5 % say the law's samples; a real render stops at its first check from there on, a
 * tenth further at most. */
static void rows_follow_the_law(void **state)
{
    (void)state;
    static const double visible[3] = {0.5, 0.25, 0.05};
    struct base_err err = {0};
    struct run pilot, real;
    start(&pilot, "0.25", 64);
    assert_int_equal(go(&pilot), PT_RENDER_PILOT);
    assert_int_equal(pt_quote_finish(pilot.quote, pilot.render, &err), 0);
    assert_int_equal(pilot.quote->row_count, 3);
    for (int i = 0; i < 3; i++) {
        char text[16];
        const struct lull_host_quote_row *row = &pilot.quote->rows[i];
        snprintf(text, sizeof text, "%g", visible[i]);
        start(&real, text, 0);
        assert_int_equal(go(&real), PT_RENDER_DONE);
        assert_int_equal(row->asked, i == 1);
        for (uint32_t k = 0; k < pilot.render->blocks->count; k++) {
            const struct lull_host_block *b = &real.render->blocks->list[k];
            double law = fmin(law_spp(b, visible[i]), 10000.0), said = row->blocks[k].stop.spp;
            assert_true(row->blocks[k].stop.known);
            assert_true(said >= 0.999 * law && said <= fmax(1.1 * law + 1.0, 8.0));
            assert_true(row->blocks[k].stop.low <= said && said <= row->blocks[k].stop.high);
            assert_true(fabs((double)b->spp / said - 1.0) < 0.11 + 2 / said); /* whole samples, of one check more */
        }
        end(&real);
    }
    assert_true(pilot.quote->rows[2].capped > 0);
    end(&pilot);
}

/* A row by error asks nobody, and says what the criterion says of itself: the law stops at 0.5, its 0.25 visible. Beyond the
 * last check and between two checks the law is found from two errors; a coarse limit is met at the first check. */
static void rows_by_error_follow_the_law(void **state)
{
    (void)state;
    static const double limits[3] = {8, 1, 0.5};
    struct base_err err = {0};
    struct lull_error e = {.struct_size = sizeof e};
    struct run pilot;
    start(&pilot, "0.25", 100);
    for (int i = 0; i < 3; i++)
        assert_int_equal(lull_host_quote_add_error(pilot.quote->quote, limits[i], &e), LULL_OK);
    assert_int_equal(go(&pilot), PT_RENDER_PILOT);
    assert_int_equal(pt_quote_finish(pilot.quote, pilot.render, &err), 0);
    assert_int_equal(pilot.quote->row_count, 6);
    for (int i = 0; i < 3; i++)
        for (uint32_t k = 0; k < pilot.render->blocks->count; k++) {
            const double law = law_spp(&pilot.render->blocks->list[k], limits[i] / 2);
            const double expected = fmax(law, (double)pilot.render->blocks->spp_min);
            assert_true(fabs(pilot.quote->rows[3 + i].blocks[k].stop.spp / expected - 1.0) < 0.03);
        }
    assert_int_equal(lull_host_quote_add_error(pilot.quote->quote, 0.0, &e), LULL_E_INVALID);
    end(&pilot);
}

static void sums_are_those_of_the_blocks(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct run pilot;
    start(&pilot, "0.25", 64);
    go(&pilot);
    for (uint32_t i = 0; i < pilot.render->blocks->count; i++)
        pilot.render->blocks->list[i].thread_s = 1e-3 * (1 + i) * (double)pilot.render->blocks->list[i].spp;
    pilot.render->totals->criterion_s = 0.5e-3 * (double)pilot.render->totals->checks;
    assert_int_equal(pt_quote_finish(pilot.quote, pilot.render, &err), 0);
    const struct lull_host_quote_row *row = &pilot.quote->rows[1];
    double thread_s = 0.0, samples = 0.0;
    for (uint32_t i = 0; i < pilot.render->blocks->count; i++) {
        const struct lull_host_block *b = &pilot.render->blocks->list[i];
        thread_s += 1e-3 * (1 + i) * row->blocks[i].stop.spp;
        samples += (b->x1 - b->x0) * (b->y1 - b->y0) * row->blocks[i].stop.spp;
    }
    assert_true(fabs(row->thread_s / thread_s - 1.0) < 1e-9);
    assert_true(fabs(row->spp_mean / (samples / (60 * 44)) - 1.0) < 1e-9);
    assert_true(fabs(row->against_uniform / (row->spp_mean / row->spp_max) - 1.0) < 1e-9);
    assert_true(row->wall_s >= 0.5 * thread_s && row->wall_s < 0.6 * thread_s + 0.1); /* two threads, an uneven tail */
    end(&pilot);
}

/* A share that is none of the three gets a row of its own, in order. */
static void what_was_asked_has_a_row(void **state)
{
    (void)state;
    struct run run;
    start(&run, "0.1", 64);
    const struct lull_host_quote *q = run.quote->quote;
    assert_int_equal(q->count, 4);
    assert_true(q->asked[2].value == 0.1 && q->asked[2].itself && q->asked[3].value == 0.05);
    end(&run);
    start(&run, "0.01", 64);
    q = run.quote->quote;
    assert_true(q->count == 4 && q->asked[3].value == 0.01 && q->asked[3].itself);
    end(&run);
}

static void uniform_needs_no_criterion(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct run run;
    start(&run, NULL, 16);
    assert_int_equal(go(&run), PT_RENDER_PILOT);
    assert_int_equal(pt_quote_finish(run.quote, run.render, &err), 0);
    assert_int_equal(run.quote->row_count, 1);
    assert_true(run.quote->rows[0].spp_min == 10000.0 && run.quote->rows[0].spp_mean == 10000.0);
    assert_int_equal(run.quote->rows[0].unknown, 0);
    for (uint32_t i = 0; i < run.render->blocks->count; i++)
        assert_int_equal(run.render->blocks->list[i].spp, 16); /* no sample beyond the pilot */
    end(&run);
}

/* The noisy picture's checks are not those of a criterion that denoises: here a quarter of a second for each block. */
static void another_criterion_takes_its_own_time(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct lull_host_criterion *other;
    struct run run;
    start(&run, "0.25", 64);
    lull_host_quote_end(run.quote->quote);
    assert_int_equal(lull_host_quote_begin(run.render->frame, 2, &run.quote->quote, NULL), LULL_OK);
    assert_int_equal(lull_host_quote_add(run.quote->quote, NULL, 1, NULL), LULL_OK);
    assert_int_equal(lull_host_create(NULL, lull_criterion_entry_v1(0), &run.pair, 1, &other, NULL), LULL_OK);
    assert_int_equal(lull_host_quote_add_other(run.quote->quote, other, NULL), LULL_OK);
    go(&run);
    run.render->totals->criterion_s = 0.25 * (double)run.render->totals->checks;
    assert_int_equal(pt_quote_finish(run.quote, run.render, &err), 0);
    const struct lull_host_quote_row *rows = run.quote->rows;
    assert_true(run.quote->row_count == 2 && rows[0].asked && !rows[1].asked);
    for (uint32_t i = 0; i < run.render->blocks->count; i++) /* the same law */
        assert_true(rows[0].blocks[i].stop.spp == rows[1].blocks[i].stop.spp);
    assert_true(rows[0].wall_s - rows[1].wall_s > 0.9 * 0.25 * (double)run.render->totals->checks);
    end(&run);
}

/* The film after a pilot and going on is the one without, bit for bit. */
static void a_pilot_loses_nothing(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct run whole, parts;
    start(&whole, "0.4", 0);
    go(&whole);
    start(&parts, "0.4", 50);
    assert_int_equal(go(&parts), PT_RENDER_PILOT);
    assert_int_equal(pt_quote_finish(parts.quote, parts.render, &err), 0);
    parts.render->config.pilot_spp = 0;
    assert_int_equal(go(&parts), PT_RENDER_DONE);
    assert_memory_equal(whole.render->film.color, parts.render->film.color, 3 * whole.render->film.pixels * sizeof(double));
    for (uint32_t i = 0; i < whole.render->blocks->count; i++)
        assert_int_equal(whole.render->blocks->list[i].spp, parts.render->blocks->list[i].spp);
    end(&whole);
    end(&parts);
}

/* 40 spp expected at 10: two octaves ahead; at 40: none; with light unmet: an octave either way, inside what is possible. */
static void intervals_widen_with_distance(void **state)
{
    (void)state;
    struct lull_host_response response = {.spp = 10, .predicted = 40.0};
    struct lull_host_stop_at far = lull_host_expect(&response, 10, 500);
    response.spp = 40;
    struct lull_host_stop_at near = lull_host_expect(&response, 10, 500);
    assert_true(far.spp == 40.0 && near.spp == 40.0);
    assert_true(near.low > far.low && far.low > 20.0 && near.high < far.high && far.high < 80.0);
    assert_true(near.low < 38.0 && near.high > 42.0);
    response.undersampled = 1;
    struct lull_host_stop_at wide = lull_host_expect(&response, 30, 70);
    assert_true(wide.low == 30.0 && wide.high == 70.0);
}

/* Every block has uniform noise; in the first of them one pixel of a hundred has a hundred times as much. */
static void light_that_few_pixels_met_is_told(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct run run;
    start(&run, "0.25", 64);
    go(&run);
    struct pt_film *film = &run.render->film;
    assert_true(film->planes & PT_FILM_HALF);
    for (int i = 0; i < 2; i++)
        film->half[3 * pt_film_index(film, 3 + 5 * i, 4) + 1] *= 100.0;
    assert_int_equal(pt_quote_finish(run.quote, run.render, &err), 0);
    for (uint32_t i = 1; i < run.render->blocks->count; i++)
        assert_false(run.quote->rows[2].blocks[i].unmet);
    assert_true(run.quote->rows[2].blocks[0].unmet);
    assert_int_equal(run.quote->rows[2].unmet, 1);
    end(&run);
}

/* What few pixels have met tells from a hundred samples on; before there is no number as soon as more than half of the
 * samples hang on it. */
static void a_pilot_that_met_too_little_is_told(void **state)
{
    (void)state;
    static const struct {
        uint32_t blocks; /* with such light, of the twelve; the law asks for 160, 320, 480, 640 spp column by column */
        uint64_t spp;    /* at which they were asked, for 1,030 */
        int told;
    } cases[] = {{12, 100, 1}, {12, 99, 0}, {6, 99, 0}, {2, 99, 1}, {0, 99, 1}};
    struct base_err err = {0};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++) {
        struct run run;
        start(&run, "0.25", 64);
        go(&run);
        struct lull_host_quote_asked *asked = &run.quote->quote->asked[1];
        for (uint32_t i = 0; i < cases[c].blocks; i++)
            asked->responses[i].first = (struct lull_host_response){.spp = 8, .predicted = 8};
        for (uint32_t i = 0; i < cases[c].blocks; i++)
            asked->responses[i].last = (struct lull_host_response){.spp = cases[c].spp, .predicted = 1030};
        assert_int_equal(pt_quote_finish(run.quote, run.render, &err), 0);
        assert_int_equal(run.quote->rows[1].unmet, cases[c].blocks);
        assert_int_equal(run.quote->rows[1].told, cases[c].told);
        assert_true(run.quote->rows[0].told && run.quote->rows[2].told);
        end(&run);
    }
}

/* A pilot is over after its time, too: here after one slice. */
static void a_pilot_ends_with_its_time(void **state)
{
    (void)state;
    struct run run;
    start(&run, "0.25", 64);
    run.render->config.pilot_s = 0;
    assert_int_equal(go(&run), PT_RENDER_PILOT);
    assert_true(lull_host_active(run.render->blocks) == 12 && run.render->blocks->list[0].spp == 1 &&
                run.render->totals->checks == 0);
    run.render->config.pilot_spp = 0; /* no pilot */
    assert_int_equal(go(&run), PT_RENDER_DONE);
    end(&run);
}

static void stops_that_nobody_predicts(void **state)
{
    (void)state;
    struct lull_host_response response = {0};
    struct lull_host_stop_at stop = lull_host_expect(&response, 20, 500);
    assert_true(!stop.known && stop.spp == 500.0 && stop.low == 20.0 && stop.high == 500.0);
    response = (struct lull_host_response){.spp = 32, .predicted = (double)NAN};
    assert_false(lull_host_expect(&response, 32, 500).known);
    response.predicted = 1e9;
    stop = lull_host_expect(&response, 32, 500);
    assert_true(stop.known && stop.spp == 500.0);
    response.predicted = 3.0;
    assert_true(lull_host_expect(&response, 32, 500).spp == 32.0);
    response.stopped = 1;
    assert_true(lull_host_expect(&response, 0, 500).spp == 3.0);
}

/* 4 threads: while both blocks are active 3 rows keep 3 busy, the single row of the second keeps one. */
static void the_last_blocks_leave_threads_idle(void **state)
{
    (void)state;
    struct lull_host_work work[2] = {{.spp = 300, .thread_s = 300, .rows = 1}, {.spp = 100, .thread_s = 200, .rows = 2}};
    assert_true(fabs(lull_host_wall_s(work, 2, 4) - (100.0 * 3.0 / 3.0 + 200.0)) < 1e-9);
    assert_true(fabs(lull_host_busy(5, 4) - 2.5) < 1e-12 && lull_host_busy(8, 4) == 4.0 && lull_host_busy(0, 4) == 0.0);
    struct lull_host_work nothing = {.rows = 4};
    assert_true(lull_host_wall_s(&nothing, 1, 2) == 0.0);
}

/* Half of the interval is 0.15 octaves and 0.08 more for each octave ahead, a whole one where light is missing; never less than there is
 * nor more than there may be. */
static void outlooks_in_closed_form(void **state)
{
    (void)state;
    static const struct {
        struct lull_host_response response;
        uint64_t spp;
        double stop, low, high;
        int known;
    } cases[] = {
        {{10, 40, 0, 0, 0}, 10, 40, 32.266, 49.588, 1}, /* 2^0.31 */
        {{40, 40, 0, 0, 0}, 10, 40, 36.050, 44.383, 1}, /* 2^0.15 */
        {{80, 40, 0, 0, 0}, 10, 40, 36.050, 44.383, 1}, /* no narrower than that */
        {{10, 40, 0, 1, 0}, 10, 40, 20, 80, 1},          {{10, 40, 0, 0, 0}, 45, 45, 45, 55.786, 1},
        {{10, 400, 0, 0, 0}, 10, 400, 268.37, 500, 1},   /* 2^(0.15 + 0.08 log2 40) = 1.4905, capped */
        {{10, 0.5, 0, 0, 0}, 0, 1, 0.90125, 1.10957, 1}, /* one sample at least */
        {{10, 900, 1, 0, 0}, 10, 500, 500, 500, 1},      {{10, 7, 1, 0, 0}, 10, 7, 7, 7, 1},
        {{0, 40, 0, 0, 0}, 10, 500, 10, 500, 0},         {{10, INFINITY, 0, 0, 0}, 10, 500, 10, 500, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lull_host_stop_at s = lull_host_expect(&cases[i].response, cases[i].spp, 500);
        if (!(fabs(s.spp - cases[i].stop) < 1e-9 && fabs(s.low / cases[i].low - 1) < 3e-4 &&
              fabs(s.high / cases[i].high - 1) < 3e-4) ||
            s.known != cases[i].known)
            fail_msg("case %zu: %g (%g to %g) %d", i, s.spp, s.low, s.high, (int)s.known);
    }
    struct lull_host_block b = {.spp = 30, .next_spp = 60, .asked = 1, .asked_spp = 20, .predicted_spp = 40};
    struct lull_host_blocks blocks = {.spp_max = 500}, uniform = {.spp_max = 500, .flags = LULL_HOST_UNIFORM};
    struct lull_host_stop_at s = lull_host_expect_block(&blocks, &b);
    assert_true(s.spp == 60 && fabs(s.low / (40 / exp2(0.23)) - 1) < 1e-12 && s.known); /* said at 20, an octave ahead */
    struct lull_host_block planned = {.spp = 30, .next_spp = 70};
    assert_true(lull_host_expect_block(&uniform, &planned).low == 70 &&
                lull_host_expect_block(&uniform, &planned).spp == 70);
    assert_true(fabs(lull_host_expect_checks(&b, 60) - 1) < 1e-12 &&
                fabs(lull_host_expect_checks(&b, 540) - 3) < 1e-12); /* threefold from check to check */
    b.asked = 0;
    assert_true(!lull_host_expect_block(&blocks, &b).known && fabs(lull_host_expect_checks(&b, 60 * 2.25) - 3) < 1e-12);
    b.asked = 1;
    b.asked_spp = 60;
    assert_true(lull_host_expect_checks(&b, 500) == 1); /* a ratio of 1 says nothing */
    b.reason = LULL_REASON_CRITERION;
    s = lull_host_expect_block(&blocks, &b);
    assert_true(s.spp == 30 && s.low == 30 && s.high == 30 && s.known && lull_host_expect_checks(&b, 500) == 0);
}

/* Every number of a quote after pilots of a known cost, but for what the clock says. "0.1 64": asked for, samples of the pilot. */
static char *quote_of(struct approve_case *c)
{
    char *text = NULL, visible[16];
    unsigned long pilot = 0;
    size_t size;
    struct base_err err = {0};
    struct run run;
    FILE *out = open_memstream(&text, &size);
    assert_true(out && sscanf(c->text, "%15s %lu", visible, &pilot) == 2);
    start(&run, visible[0] == '-' ? NULL : visible, pilot);
    fprintf(out, "outcome %d\n", go(&run));
    struct pt_render *r = run.render;
    for (uint32_t i = 0; i < r->blocks->count; i++)
        r->blocks->list[i].thread_s = 1e-3 * (1 + i) * (double)r->blocks->list[i].spp;
    if (strstr(c->text, "unasked"))
        r->blocks->list[3].spp = r->blocks->list[3].half_spp = r->blocks->list[3].asked = 0;
    for (uint32_t i = 0; i < run.quote->quote->count && strstr(c->text, "unsaid"); i++)
        run.quote->quote->asked[i].responses[2].last =
            (struct lull_host_response){.spp = r->blocks->list[2].spp, .predicted = (double)NAN};
    r->totals->criterion_s = 0.25 * (double)r->totals->checks;
    assert_int_equal(pt_quote_finish(run.quote, r, &err), 0);
    fprintf(out, "a check takes %.9g\n", run.quote->quote->check_s);
    for (uint32_t i = 0; i < run.quote->row_count; i++) {
        const struct lull_host_quote_row *row = &run.quote->rows[i];
        fprintf(
            out,
            "row %g asked %d spp %.9g %.9g %.9g from %.9g to %.9g thread %.9g %.9g %.9g wall %.9g %.9g %.9g of uniform %.9g",
            run.quote->rows[i].value, row->asked, row->spp_min, row->spp_mean, row->spp_max, row->spp_mean_low,
            row->spp_mean_high, row->thread_s, row->thread_low_s, row->thread_high_s, row->wall_s, row->wall_low_s,
            row->wall_high_s, row->against_uniform);
        fprintf(out, " unknown %u unmet %u capped %u\n", row->unknown, row->unmet, row->capped);
        for (uint32_t k = 0; k < run.render->blocks->count; k++) {
            const struct lull_host_quote_block *b = &row->blocks[k];
            const struct lull_host_response *response = &run.quote->quote->asked[i].responses[k].last,
                                            *first = &run.quote->quote->asked[i].responses[k].first;
            fprintf(out, "  block %u said %llu %.9g%s%s first %llu %.9g stop %.9g %.9g %.9g %d thread %.9g %.9g %.9g\n", k,
                    (unsigned long long)response->spp, response->predicted, response->stopped ? " stopped" : "",
                    response->undersampled ? " unmet" : "", (unsigned long long)first->spp, first->predicted, b->stop.spp,
                    b->stop.low, b->stop.high, (int)b->stop.known, b->thread_s, b->thread_low_s, b->thread_high_s);
        }
    }
    end(&run);
    fclose(out);
    return text;
}

static void quotes_in_every_number(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_quote.txt", quote_of);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_follow_the_law),
        cmocka_unit_test(rows_by_error_follow_the_law),
        cmocka_unit_test(sums_are_those_of_the_blocks),
        cmocka_unit_test(what_was_asked_has_a_row),
        cmocka_unit_test(another_criterion_takes_its_own_time),
        cmocka_unit_test(uniform_needs_no_criterion),
        cmocka_unit_test(a_pilot_loses_nothing),
        cmocka_unit_test(stops_that_nobody_predicts),
        cmocka_unit_test(intervals_widen_with_distance),
        cmocka_unit_test(light_that_few_pixels_met_is_told),
        cmocka_unit_test(the_last_blocks_leave_threads_idle),
        cmocka_unit_test(outlooks_in_closed_form),
        cmocka_unit_test(quotes_in_every_number),
        cmocka_unit_test(a_pilot_ends_with_its_time),
        cmocka_unit_test(a_pilot_that_met_too_little_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
