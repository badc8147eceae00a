/* What a slice does: time dealt out, rows cut into runs, checks that are too dear, the last question, the order of work. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <cmocka.h>

#include "render/rows.h"
#include "support/pt_fake.h"
#include "support/pt_captured.h"

/* --- what a slice does -------------------------------------------------------------------------------------------------- */

/* The rows that a kernel was asked for: blocks begin at multiples of 16, and so does the first call of a row. */
enum { ROWS = 4096 };

static struct {
    uint32_t x, y, from, to;
} rows[ROWS];

static int row_count;

static void write_down(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                       uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x, y, count, sample, out);
    if (x % 16 != 0)
        return;
    if (row_count > 0 && rows[row_count - 1].x == x && rows[row_count - 1].y == y && rows[row_count - 1].to == sample) {
        rows[row_count - 1].to++;
        return;
    }
    assert_true(row_count < ROWS);
    rows[row_count].x = x;
    rows[row_count].y = y;
    rows[row_count].from = sample;
    rows[row_count++].to = sample + 1;
}

static int enough(void *data, struct pt_render *r, struct base_err *err)
{
    (void)data;
    (void)r;
    return base_fail(err, BASE_EINVAL, "enough");
}

struct slice_case {
    uint64_t spp[3], next[3];
    double per_spp_s[3], busy, budget_s, elapsed_s;
    uint64_t pilot;
    int order[4]; /* of blocks, -1 after the last */
    uint32_t to[3];
};

static void check_slice(const struct slice_case *c)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    const struct pt_render_hooks hooks = {.slice = enough};
    struct pt_fake_run r = {.pool = base_threads_create(1, &err)};
    config.width = config.crop[2] = 48;
    config.height = config.crop[3] = 16;
    config.spp_max = 1000;
    config.time_budget_s = c->budget_s;
    config.pilot_spp = c->pilot;
    config.pilot_s = 1e9;
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, r.pool, NULL, &r.criterion, &err), 0);
    assert_int_equal(pt_render_create(&config, NULL, write_down, r.pool, r.criterion, &r.render, &err), 0);
    for (int i = 0; i < 3; i++) {
        r.render->blocks->list[i].spp = c->spp[i];
        r.render->blocks->list[i].next_spp = c->next[i];
        r.render->blocks->list[i].thread_s = c->per_spp_s[i] * (double)c->spp[i];
    }
    r.render->busy_threads = c->busy;
    r.render->totals->render_s = c->elapsed_s;
    row_count = 0;
    assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), BASE_EINVAL);
    int k = 0;
    uint64_t samples = 0;
    for (int n = 0; c->order[n] >= 0; n++)
        for (uint32_t y = 0, b = (uint32_t)c->order[n]; y < 16; y++, k++) {
            assert_true(rows[k].x == 16 * b && rows[k].y == y && rows[k].from == c->spp[b] && rows[k].to == c->to[b]);
            samples += 16 * (c->to[b] - c->spp[b]);
        }
    assert_int_equal(k, row_count);
    for (int i = 0; i < 3; i++) {
        const struct lull_host_block *b = &r.render->blocks->list[i];
        uint64_t end = c->to[i] ? c->to[i] : c->spp[i];
        assert_true(b->spp == end && b->rays == 3 * 256 * (end - c->spp[i]));
        assert_true(c->to[i] == 0 || b->thread_s > c->per_spp_s[i] * (double)c->spp[i]);
    }
    const struct lull_host_totals *t = r.render->totals;
    assert_true(t->samples == samples && t->paths == samples && t->rays == 3 * samples && t->dropped == 0 && t->checks == 0);
    assert_true(t->render_s > c->elapsed_s && r.render->samples_per_s > 0 && r.render->sampled_rows == row_count);
    pt_fake_release(&r);
}

/* Who has few samples goes first, by octaves; then who is furthest from its check. A slice is a quarter of a second of those that are
 * busy, no block gets more than its samples again (8 at least), and what is not known yet gets one. */
static void slices_deal_out_the_time(void **state)
{
    (void)state;
    static const struct slice_case cases[] = {
        {{0, 0, 0}, {100, 100, 100}, {0}, 0, 0, 0, 0, {0, 1, 2, -1}, {1, 1, 1}},
        {{40, 10, 12}, {100, 100, 100}, {1e-9, 1e-9, 2e-9}, 0, 0, 0, 0, {2, 1, 0, -1}, {80, 20, 24}},
        {{40, 10, 12}, {100, 100, 100}, {0.01, 0.02, 0.02}, 0, 0, 0, 0, {1, 2, 0, -1}, {45, 15, 17}},
        {{40, 10, 12}, {100, 100, 100}, {0.01, 0.02, 0.02}, 3, 0, 0, 0, {1, 2, 0, -1}, {55, 20, 24}},
        {{40, 10, 12}, {100, 100, 100}, {0.5, 0.25, 0.25}, 1, 0, 0, 0, {1, 2, 0, -1}, {41, 11, 13}},
        {{40, 0, 12}, {100, 100, 100}, {1e-9, 0, 1e-9}, 0, 0, 0, 0, {1, 2, 0, -1}, {41, 1, 13}},
        {{40, 10, 12}, {45, 14, 12}, {0.01, 0.02, 0.02}, 2, 0, 0, 0, {1, 0, -1}, {45, 14, 0}},
        {{40, 15, 16}, {46, 100, 100}, {1e-9, 1e-9, 1e-9}, 0, 0, 0, 0, {1, 2, 0, -1}, {46, 30, 32}},
        {{64, 31, 32}, {200, 200, 200}, {1e-9, 1e-9, 1e-9}, 0, 0, 0, 0, {1, 2, 0, -1}, {128, 62, 64}},
        {{3, 5, 4}, {100, 100, 100}, {1e-9, 1e-9, 1e-9}, 0, 0, 0, 0, {0, 2, 1, -1}, {11, 13, 12}},
        {{40, 40, 40}, {100, 100, 100}, {1e-9, 1e-9, 1e-9}, 0, 0, 0, 44, {0, 1, 2, -1}, {44, 44, 44}},
        {{40, 40, 40}, {100, 100, 100}, {0.002, 0.002, 0.002}, 0, 1.0, 0.9349, 0, {0, 1, 2, -1}, {50, 50, 50}},
        {{40, 40, 40}, {100, 100, 100}, {0.0003, 0.0003, 0.0003}, 0, 1.0, 2.0, 0, {0, 1, 2, -1}, {51, 51, 51}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        check_slice(&cases[i]);
}

static struct {
    uint32_t x, y, sample;
    int count;
} runs[64];

static int run_count;

/* Radiance tells place and sample; of sample 7 every 50th pixel is no number. */
static void print_place(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                        int count, uint32_t sample, struct pt_path_result *out)
{
    (void)scene;
    (void)settings;
    assert_true(run_count < 64);
    runs[run_count].x = x;
    runs[run_count].y = y;
    runs[run_count].sample = sample;
    runs[run_count++].count = count;
    for (int i = 0; i < count; i++)
        out[i] = (struct pt_path_result){
            .radiance = v3((float)x + (float)i, (float)y, sample == 7 && (x + (uint32_t)i) % 50 == 49 ? NAN : (float)sample),
            .rays = 2};
}

/* A row is sampled in runs of neighbours, each pixel once for each sample; what is saved of it is restored. */
static void rows_are_cut_into_runs(void **state)
{
    (void)state;
    for (int width = 2 * PT_RUN - 1; width <= 2 * PT_RUN + 1; width++) {
        struct pt_film film;
        struct base_err err = {0};
        struct pt_integrator integrator = {0};
        const struct pt_sampler_context context = {NULL, print_place, &integrator};
        struct pt_row row = {.y = 6, .x0 = 3, .x1 = 3 + width, .from = 5, .to = 8};
        assert_int_equal(pt_film_init(&film, 1, 5, 140, 8, PT_FILM_HALF, &err), 0);
        run_count = 0;
        pt_row_sample(&context, &film, &row);
        int per_sample = width > 2 * PT_RUN ? 3 : 2, n = 0;
        assert_int_equal(run_count, 3 * per_sample);
        for (int k = 0; k < per_sample; k++)
            for (uint32_t s = 5; s < 8; s++, n++) {
                int left = width - k * PT_RUN;
                assert_true(runs[n].x == 3 + (uint32_t)(k * PT_RUN) && runs[n].y == 6 && runs[n].sample == s &&
                            runs[n].count == (left < PT_RUN ? left : PT_RUN));
            }
        assert_true(row.rays == 6 * (uint64_t)width && row.dropped == 2 && row.first_x == 49 && row.first_sample == 7 &&
                    row.thread_s >= 0);
        for (int y = 5; y < 8; y++)
            for (int x = 1; x < 140; x++) {
                size_t i = pt_film_index(&film, x, y);
                int inside = y == 6 && x >= 3 && x < 3 + width, bad = inside && x % 50 == 49;
                double n_kept = inside ? 3 - bad : 0;
                assert_true(film.color[3 * i] == n_kept * x && film.color[3 * i + 1] == n_kept * 6 &&
                            film.dropped[i] == (uint32_t)bad);
                assert_true(film.color[3 * i + 2] == (inside ? 5 + 6 + (bad ? 0 : 7) : 0));
            }
        size_t bytes = pt_row_bytes(&row, film.planes);
        assert_int_equal(bytes, (size_t)width * 56);
        unsigned char *saved = malloc(bytes);
        double *copy = malloc(film.pixels * 24);
        pt_row_save(&film, &row, saved);
        memcpy(copy, film.color, film.pixels * 24);
        for (int x = row.x0; x < row.x1; x++) {
            film.color[3 * pt_film_index(&film, x, 6)] = -1;
            film.half[3 * pt_film_index(&film, x, 6) + 2] = -1;
            film.dropped[pt_film_index(&film, x, 6)] = film.dropped_half[pt_film_index(&film, x, 6)] = 9;
        }
        pt_row_restore(&film, &row, saved);
        assert_memory_equal(film.color, copy, film.pixels * 24);
        for (int x = row.x0; x < row.x1; x++)
            assert_true(film.half[3 * pt_film_index(&film, x, 6) + 2] >= 0 && film.dropped[pt_film_index(&film, x, 6)] < 2 &&
                        film.dropped_half[pt_film_index(&film, x, 6)] < 2);
        free(copy);
        free(saved);
        pt_film_release(&film);
    }
}

/* Half of the time may go to checks: at 9 of 19 seconds they are asked for, at 11 of 21 left out, except of who gets no more samples. */
static void checks_may_be_too_dear(void **state)
{
    (void)state;
    for (int dear = 0; dear < 2; dear++) {
        struct pt_render_config config = pt_fake_config();
        struct base_err err = {0};
        enum pt_render_outcome outcome;
        struct captured messages;
        const struct pt_render_hooks hooks = {.slice = enough, .log = &messages.log};
        struct pt_fake_run r = {.pool = base_threads_create(1, &err)};
        capture_begin(&messages);
        config.width = config.crop[2] = 48;
        config.height = config.crop[3] = 16;
        config.spp_max = 30;
        config.max_check_overhead = 0.5;
        assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, r.pool, NULL, &r.criterion, &err), 0);
        assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, r.pool, r.criterion, &r.render, &err), 0);
        struct lull_host_block *b = r.render->blocks->list;
        for (int i = 0; i < 3; i++)
            b[i].spp = b[i].next_spp = i < 2 ? 20 : 30;
        r.render->totals->render_s = 10;
        r.render->totals->criterion_s = dear ? 11 : 9;
        assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), BASE_EINVAL);
        const struct lull_host_totals *t = r.render->totals;
        assert_true(t->checks == (dear ? 0 : 2) && t->skipped_checks == (dear ? 2 : 0) && t->failed_checks == 0 &&
                    !messages.text[0]);
        capture_end(&messages);
        assert_true(t->asked == t->checks &&
                    (dear ? t->criterion_s == 11 : t->criterion_s > 9 && t->criterion_thread_s > 0));
        for (int i = 0; i < 2; i++)
            assert_true(b[i].reason == LULL_REASON_NONE && b[i].next_spp == 23 && b[i].checks == (dear ? 0 : 1) &&
                        b[i].asked == b[i].checks && b[i].asked_spp == (dear ? 0 : 20) &&
                        (dear || b[i].predicted_spp == 32 * (i + 1)));
        assert_true(b[2].reason == LULL_REASON_NONE && b[2].checks == 0); /* waits for the others */
        b[0].spp = b[1].spp = 30;
        r.render->totals->criterion_s = dear ? 1e6 : 0;
        assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), 0);
        for (int i = 0; i < 3; i++)
            assert_true(b[i].reason != LULL_REASON_NONE && b[i].checks == (!dear && i < 2 ? 2 : 1));
        pt_fake_release(&r);
    }
}

/* What the render is when it may be saved: as it would go on. */
static int look_before(void *data, struct pt_render *r, struct base_err *err)
{
    (void)err;
    *(int *)data += 10 + (int)lull_host_active(r->blocks);
    assert_true(r->blocks->list[1].checks == 0 && r->totals->checks == 0);
    return 0;
}

/* At an interrupt who was asked at these very samples is not asked again, who is stopped neither; the others are, for the report. */
static void interrupted_blocks_are_asked_once_more(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    int looks = 0;
    static const volatile sig_atomic_t always = 1;
    const struct pt_render_hooks hooks = {.interrupted = &always, .suspend = look_before, .data = &looks};
    struct pt_fake_run r = {.pool = base_threads_create(1, &err)};
    config.width = config.crop[2] = 48;
    config.height = config.crop[3] = 16;
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, r.pool, NULL, &r.criterion, &err), 0);
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, r.pool, r.criterion, &r.render, &err), 0);
    struct lull_host_block *b = r.render->blocks->list;
    for (int i = 0; i < 3; i++)
        b[i].spp = b[i].next_spp = 20;
    b[0].asked = 1;
    b[0].asked_spp = 20;
    b[1].next_spp = 100;
    b[1].asked = 1; /* once, at fewer samples */
    b[1].asked_spp = 20;
    b[2].reason = LULL_REASON_SPP_MAX;
    assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), 0);
    assert_true(outcome == PT_RENDER_INTERRUPTED && looks == 12);
    assert_true(b[0].reason == LULL_REASON_INTERRUPT && b[0].checks == 0 && b[0].spp == 20 && isnan(b[0].error));
    assert_true(b[1].reason == LULL_REASON_INTERRUPT && b[1].checks == 1 && b[1].spp == 21 && b[1].asked_spp == 21 &&
                b[1].predicted_spp == 64);
    assert_true(b[2].reason == LULL_REASON_SPP_MAX && b[2].checks == 0);
    assert_true(r.render->totals->checks == 1 && lull_host_active(r.render->blocks) == 0);
    pt_fake_release(&r);
}

/* With a seed the same rows are handed out in another order; without one block after block, as many as give each thread 128 rows. */
static void the_order_of_work_follows_its_seed(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    const struct pt_render_hooks hooks = {.slice = enough};
    static const uint32_t seeds[4] = {0, 99, 99, 100};
    uint32_t order[4][128];
    for (int k = 0; k < 4; k++) {
        struct base_err err = {0};
        enum pt_render_outcome outcome;
        struct pt_fake_run r = {.pool = base_threads_create(1, &err)};
        uint8_t seen[128] = {0};
        config.order_seed = seeds[k];
        assert_int_equal(pt_criterion_create(pt_fake_criterion(), NULL, 0, r.pool, NULL, &r.criterion, &err), 0);
        assert_int_equal(pt_render_create(&config, NULL, write_down, r.pool, r.criterion, &r.render, &err), 0);
        row_count = 0;
        assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), BASE_EINVAL);
        assert_int_equal(row_count, 128);
        for (int i = 0; i < 128; i++) {
            order[k][i] = (rows[i].y / 16 * 4 + rows[i].x / 16) * 16 + rows[i].y % 16;
            assert_true(order[k][i] < 128 && !seen[order[k][i]]++ && rows[i].from == 0 && rows[i].to == 1);
        }
        for (int i = 0; i < 8; i++)
            assert_int_equal(r.render->blocks->list[i].spp, 1);
        pt_fake_release(&r);
    }
    int moved = 0, apart = 0;
    for (uint32_t i = 0; i < 128; i++) {
        assert_int_equal(order[0][i], i);
        moved += order[1][i] != i;
        apart += order[1][i] != order[3][i];
    }
    assert_memory_equal(order[1], order[2], sizeof order[1]);
    assert_true(moved > 100 && apart > 100);
}

/* Each block is looked at before each slice: of tiny ones a slice takes as many as make rows of 16 pixels. */
static void tiny_blocks_come_many_at_a_time(void **state)
{
    static const struct {
        int block;
        long rows;
    } cases[] = {{16, 128}, {4, 128 * 4}, {1, 128 * 16}};
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct pt_render_config config = pt_fake_config();
        const struct pt_render_hooks hooks = {.slice = enough};
        struct base_err err = {0};
        enum pt_render_outcome outcome;
        struct pt_fake_run r = {.pool = base_threads_create(1, &err)};
        config.width = config.crop[2] = 64;
        config.height = config.crop[3] = 48;
        config.block_width = config.block_height = cases[i].block;
        config.uniform = 1;
        config.spp_min = config.spp_max;
        assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, r.pool, NULL, &r.render, &err), 0);
        assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), BASE_EINVAL);
        assert_int_equal(r.render->sampled_rows, cases[i].rows);
        pt_fake_release(&r);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(slices_deal_out_the_time),        cmocka_unit_test(rows_are_cut_into_runs),
        cmocka_unit_test(checks_may_be_too_dear),          cmocka_unit_test(interrupted_blocks_are_asked_once_more),
        cmocka_unit_test(tiny_blocks_come_many_at_a_time), cmocka_unit_test(the_order_of_work_follows_its_seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
