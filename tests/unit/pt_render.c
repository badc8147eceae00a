#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

#include <cmocka.h>

#include "base/files.h"

#include "render/checkpoint.h"
#include "render/rows.h"
#include "support/pt_fake.h"
#include "support/pt_heard.h"

struct result {
    struct pt_render *render;
    struct lull_host_criterion *criterion;
    struct base_threads *pool;
};

static struct result render(const struct pt_render_config *config, pt_kernel *kernel, int threads, const char *at)
{
    struct result r = {0};
    assert_int_equal(pt_fake_render(config, kernel, threads, at, &r.render, &r.criterion, &r.pool), 0);
    return r;
}

static void release(struct result *r)
{
    pt_render_destroy(r->render);
    lull_host_close(r->criterion);
    base_threads_destroy(r->pool);
    *r = (struct result){0};
}

/* Same film bytes and same decisions; times aside. */
static void assert_same(const struct pt_render *a, const struct pt_render *b)
{
    struct pt_film_array x[PT_FILM_ARRAYS], y[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&a->film, x);
    assert_int_equal(n, pt_film_list_arrays(&b->film, y));
    for (int i = 0; i < n; i++)
        assert_memory_equal(x[i].data, y[i].data, x[i].bytes);
    assert_int_equal(a->blocks->count, b->blocks->count);
    for (uint32_t i = 0; i < a->blocks->count; i++) {
        const struct lull_host_block *p = &a->blocks->list[i], *q = &b->blocks->list[i];
        assert_int_equal(p->spp, q->spp);
        assert_int_equal(p->reason, q->reason);
        assert_int_equal(p->checks, q->checks);
        assert_memory_equal(&p->error, &q->error, sizeof p->error);
        assert_memory_equal(&p->p_noisy, &q->p_noisy, sizeof p->p_noisy);
    }
}

static void blocks_stop_where_the_criterion_says(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct result r = render(&config, pt_fake_noise, 2, "32");
    assert_int_equal(r.render->blocks->count, 12);
    for (uint32_t i = 0; i < 12; i++) {
        const struct lull_host_block *b = &r.render->blocks->list[i];
        uint64_t at = 32 * (1 + i % 4);
        assert_in_range(b->spp, at, at + at / 5 + 1);
        assert_int_equal(b->reason, LULL_REASON_CRITERION);
        assert_true(fabs(b->error - 0.75) < 0.02);
    }
    assert_int_equal(r.render->blocks->list[11].x1, 60);
    assert_int_equal(r.render->blocks->list[11].y1, 44);
    release(&r);
}

static void same_bytes_for_any_threads_and_order(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.planes = PT_FILM_ALL;
    struct result one = render(&config, pt_fake_noise, 1, "32");
    const int threads[] = {2, 3, 8, 3};
    for (int i = 0; i < 4; i++) {
        config.order_seed = i < 3 ? 0 : 99;
        struct result other = render(&config, pt_fake_noise, threads[i], "32");
        assert_same(one.render, other.render);
        release(&other);
    }
    release(&one);
}

static void uniform_without_criterion(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_min = config.spp_max = 50;
    config.uniform = 1;
    int crop[4] = {10, 9, 37, 20};
    memcpy(config.crop, crop, sizeof crop);
    struct result r = render(&config, pt_fake_noise, 2, NULL);
    assert_int_equal(r.render->film.pixels, 27 * 11);
    assert_int_equal(r.render->totals->samples, 27 * 11 * 50);
    assert_int_equal(r.render->totals->rays, 3 * 27 * 11 * 50);
    for (uint32_t i = 0; i < r.render->blocks->count; i++)
        assert_int_equal(r.render->blocks->list[i].reason, LULL_REASON_UNIFORM);
    release(&r);
}

/* A block is judged whole whatever part of it is kept. */
static void crop_changes_no_decision(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct result whole = render(&config, pt_fake_noise, 2, "32");
    int crop[4] = {20, 20, 30, 25};
    memcpy(config.crop, crop, sizeof crop);
    struct result part = render(&config, pt_fake_noise, 2, "32");
    assert_int_equal(part.render->blocks->count, 1);
    const struct lull_host_block *p = &part.render->blocks->list[0], *w = &whole.render->blocks->list[5];
    assert_int_equal(p->id, 5);
    assert_int_equal(p->spp, w->spp);
    assert_memory_equal(&p->error, &w->error, sizeof p->error);
    assert_int_equal(p->x1 - p->x0, 16);
    release(&whole);
    release(&part);
}

static void spp_max_ends_a_block(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_max = 100;
    struct result r = render(&config, pt_fake_noise, 2, "1000");
    for (uint32_t i = 0; i < 12; i++) {
        assert_int_equal(r.render->blocks->list[i].spp, 100);
        assert_int_equal(r.render->blocks->list[i].reason, LULL_REASON_SPP_MAX);
        assert_true(r.render->blocks->list[i].asked);
    }
    release(&r);
}

static void dropped_samples_never_converge_nor_live_for_ever(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    pt_kernel *const kernels[] = {pt_fake_nan, pt_fake_all_nan};
    for (int k = 0; k < 2; k++) {
        struct result r = render(&config, kernels[k], 2, "16");
        assert_true(r.render->totals->dropped > 0);
        uint32_t kept;
        const struct lull_host_sample *dropped = lull_host_dropped(r.render->frame, &kept);
        assert_true(kept > 0);
        assert_true(dropped[0].x < 8);
        if (k == 0)
            assert_int_equal(dropped[0].sample % 97, 5);
        for (uint32_t i = 0; i < 12; i++) {
            const struct lull_host_block *b = &r.render->blocks->list[i];
            assert_int_equal(b->reason, b->x0 < 8 ? LULL_REASON_DROPPED : LULL_REASON_CRITERION);
            assert_in_range(b->spp, 16, 120);
            if (k == 0)
                assert_true(fabs(b->error - 0.75) < 0.02);
        }
        for (size_t i = 0; i < 3 * r.render->film.pixels; i++)
            assert_true(isfinite(r.render->film.color[i]));
        release(&r);
    }
}

static void seams_are_bounded(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.max_seam = 1.5;
    struct result r = render(&config, pt_fake_noise, 2, "32");
    const struct lull_host_blocks *b = r.render->blocks;
    for (uint32_t i = 0; i < b->count; i++) {
        if (i % 4 > 0)
            assert_true((double)b->list[i - 1].spp * 1.5 + 2 >= (double)b->list[i].spp);
        if (i % 4 < 3)
            assert_true((double)b->list[i + 1].spp * 1.5 + 2 >= (double)b->list[i].spp);
    }
    release(&r);
}

/* --- time, interrupt, checkpoint ------------------------------------------------------------------------------------ */

struct stop_after {
    int slices;
    const char *checkpoint;
    volatile sig_atomic_t now;
};

static int count_down(void *data, struct pt_render *r, struct base_err *err)
{
    struct stop_after *s = data;
    (void)r, (void)err;
    s->now = --s->slices <= 0;
    return 0;
}

static int save(void *data, struct pt_render *r, struct base_err *err)
{
    const struct stop_after *s = data;
    return pt_checkpoint_save(s->checkpoint, r, "a=1\nb=2\n", err);
}

static void time_budget_ends_a_render(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_max = 1000000;
    config.time_budget_s = 0.05;
    struct result r = render(&config, pt_fake_noise, 2, "900000");
    int timed = 0;
    for (uint32_t i = 0; i < 12; i++)
        timed += r.render->blocks->list[i].reason == LULL_REASON_TIME;
    assert_int_equal(timed, 12);
    assert_true(r.render->blocks->list[0].asked);
    assert_true(r.render->blocks->list[0].asked_spp == r.render->blocks->list[0].spp);
    release(&r);
}

/* Interrupted after each of the first slices, saved, loaded into a new render and finished: the same bytes. */
static void resumed_render_is_identical(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    config.planes = PT_FILM_ALL;
    struct result whole = render(&config, pt_fake_nan, 2, "32");
    for (int slices = 1; slices < 12; slices += 2) {
        struct stop_after stop = {.slices = slices, .checkpoint = path};
        struct pt_render_hooks hooks = {.slice = count_down, .interrupted = &stop.now, .suspend = save, .data = &stop},
                               none = {0};
        enum pt_render_outcome outcome;
        struct base_err err = {0};
        struct result r = {.pool = base_threads_create(2, &err)};
        struct lull_pair pair = {"at", "32"};
        for (int part = 0; part < 2; part++) {
            assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r.pool, NULL, &r.criterion, &err), 0);
            assert_int_equal(pt_render_create(&config, NULL, pt_fake_nan, r.pool, r.criterion, &r.render, &err), 0);
            if (part == 1)
                assert_int_equal(pt_checkpoint_load(path, r.render, "a=1\nb=2\n", &err), 0);
            assert_int_equal(pt_render_run(r.render, part == 0 ? &hooks : &none, &outcome, &err), 0);
            assert_int_equal(outcome, part == 0 ? PT_RENDER_INTERRUPTED : PT_RENDER_DONE);
            if (part == 0) {
                pt_render_destroy(r.render);
                lull_host_close(r.criterion);
            }
        }
        assert_same(whole.render, r.render);
        release(&r);
    }
    release(&whole);
    unlink(path);
}

static void bad_checkpoints_are_refused(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    struct result r = render(&config, pt_fake_noise, 1, "16");
    struct base_err err = {0};
    assert_int_equal(pt_checkpoint_save(path, r.render, "seed=1\n", &err), 0);
    assert_int_equal(pt_checkpoint_load(path, r.render, "seed=2\n", &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "made with seed=1, but this render has seed=2"));
    FILE *f = fopen(path, "rb");
    static unsigned char data[1 << 20];
    size_t n = fread(data, 1, sizeof data, f);
    fclose(f);
    for (size_t cut = 0; cut < n; cut += n / 17 + 1) {
        f = fopen(path, "wb");
        fwrite(data, 1, cut, f);
        fclose(f);
        assert_int_equal(pt_checkpoint_load(path, r.render, "seed=1\n", &err), BASE_EINVAL);
    }
    for (size_t at = 0; at < n; at += n / 13 + 1) {
        data[at] ^= 0x10;
        f = fopen(path, "wb");
        fwrite(data, 1, n, f);
        fclose(f);
        assert_int_equal(pt_checkpoint_load(path, r.render, "seed=1\n", &err), BASE_EINVAL);
        data[at] ^= 0x10;
    }
    release(&r);
    unlink(path);
}

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
    struct result r = {.pool = base_threads_create(1, &err)};
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
    release(&r);
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
static void tell_place(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                       uint32_t sample, struct pt_path_result *out)
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
        const struct pt_row_maker maker = {NULL, tell_place, &integrator};
        struct pt_row row = {.y = 6, .x0 = 3, .x1 = 3 + width, .from = 5, .to = 8};
        assert_int_equal(pt_film_init(&film, 1, 5, 140, 8, PT_FILM_HALF, &err), 0);
        run_count = 0;
        pt_row_sample(&maker, &film, &row);
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
        struct heard heard;
        const struct pt_render_hooks hooks = {.slice = enough, .log = &heard.log};
        struct result r = {.pool = base_threads_create(1, &err)};
        hear_begin(&heard);
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
        assert_true(t->checks == (dear ? 1 : 3) && t->skipped_checks == (dear ? 2 : 0) && t->failed_checks == 0 &&
                    !heard.text[0]);
        hear_end(&heard);
        assert_true(t->asked == t->checks && t->criterion_s > (dear ? 11 : 9) && t->criterion_thread_s > 0);
        for (int i = 0; i < 2; i++)
            assert_true(b[i].reason == LULL_REASON_NONE && b[i].next_spp == 23 && b[i].checks == (dear ? 0 : 1) &&
                        b[i].asked == b[i].checks && b[i].asked_spp == (dear ? 0 : 20) &&
                        (dear || b[i].predicted_spp == 32 * (i + 1)));
        assert_true(b[2].reason == LULL_REASON_SPP_MAX && b[2].checks == 1);
        release(&r);
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
    struct result r = {.pool = base_threads_create(1, &err)};
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
    release(&r);
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
        struct result r = {.pool = base_threads_create(1, &err)};
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
        release(&r);
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

/* --- a checkpoint, byte by byte ------------------------------------------------------------------------------------------ */

static const unsigned char *piece(const unsigned char *at, const void *expected, size_t n)
{
    assert_memory_equal(at, expected, n);
    return at + n;
}

static const unsigned char *word(const unsigned char *at, uint64_t expected) { return piece(at, &expected, 8); }

static const unsigned char *check_block_record(const unsigned char *at, const struct lull_host_block *b)
{
    at = word(word(word(word(word(at, b->spp), b->next_spp), b->asked_spp), b->rays), b->dropped);
    at = piece(piece(piece(piece(at, &b->p_noisy, 8), &b->error, 8), &b->predicted_spp, 8), &b->thread_s, 8);
    return piece(piece(piece(piece(at, &b->reason, 4), &b->checks, 4), &b->stop_votes, 4), &b->asked, 4);
}

/* Writes the bytes with a good checksum and wants this answer. */
static void expect_answer(const char *path, unsigned char *data, size_t n, struct pt_render *r, const char *settings,
                          const char *words)
{
    struct base_err err = {0};
    char line[256];
    uint32_t crc = (uint32_t)crc32_z(0, data, n - 4);
    memcpy(data + n - 4, &crc, 4);
    FILE *f = fopen(path, "wb");
    assert_true(f && fwrite(data, 1, n, f) == n && fclose(f) == 0);
    int rc = pt_checkpoint_load(path, r, settings, &err);
    snprintf(line, sizeof line, "%s: %s", path, words ? words : "");
    if (rc != (words ? BASE_EINVAL : 0) || (words && strcmp(err.text, line) != 0))
        fail_msg("%d \"%s\", expected \"%s\"", rc, err.text, line);
}

static void put_word(unsigned char *at, uint64_t value) { memcpy(at, &value, 8); }

static void checkpoints_have_a_layout(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX", *bytes;
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    size_t size;
    config.planes = PT_FILM_ALL;
    struct result r = render(&config, pt_fake_nan, 1, "16");
    const struct pt_film *f = &r.render->film;
    uint32_t kept;
    const struct lull_host_sample *dropped = lull_host_dropped(r.render->frame, &kept);
    assert_true(kept > 0 && kept <= LULL_HOST_DROPPED_KEPT);
    assert_int_equal(pt_checkpoint_save(path, r.render, "a=1\nb=2\n", &err), 0);
    assert_int_equal(base_file_read(path, 1 << 24, &bytes, &size, &err), 0);
    unsigned char *data = (unsigned char *)bytes;
    const unsigned char *at = piece(word(piece(data, "LULLCKP1", 8), 8), "a=1\nb=2\n", 8), *film = at, *list, *drops,
                        *history;
    at = word(at, f->bytes);
    assert_int_equal(f->bytes, f->pixels * 124);
    at = piece(piece(piece(at, f->color, 24 * f->pixels), f->half, 24 * f->pixels), f->moment2, 8 * f->pixels);
    at = piece(piece(piece(at, f->albedo, 24 * f->pixels), f->normal, 24 * f->pixels), f->depth, 8 * f->pixels);
    at = piece(piece(piece(at, f->depth_hits, 4 * f->pixels), f->dropped, 4 * f->pixels), f->dropped_half, 4 * f->pixels);
    list = at;
    at = word(at, 12);
    for (int i = 0; i < 12; i++)
        at = check_block_record(at, &r.render->blocks->list[i]);
    const struct lull_host_totals *t = r.render->totals;
    at = word(word(word(word(at, t->samples), t->paths), t->rays), t->dropped);
    at = piece(piece(at, &t->render_s, 8), &t->criterion_s, 8);
    drops = at = word(word(word(at, t->checks), t->failed_checks), t->skipped_checks);
    history = at = piece(word(at, kept), dropped, 12 * LULL_HOST_DROPPED_KEPT);
    at = word(at, 4 * 64) + 4 * 64; /* the fake criterion's counts */
    assert_int_equal(at + 4 - data, size);

    struct {
        size_t at;
        uint64_t good, bad;
        const char *words;
    } const faults[] = {
        {(size_t)(film - data), f->bytes, f->bytes + 1, "the checkpoint has another number of bytes of pixels"},
        {(size_t)(list - data), 12, 11, "the checkpoint has another number of blocks"},
        {(size_t)(list - data) + 8 + 88 * 5, 256, 257, "block 5 of the checkpoint makes no sense"},
        {(size_t)(list - data) + 16 + 88 * 11, 256, 257, "block 11 of the checkpoint makes no sense"},
        {(size_t)(drops - data), 16, 17, "the checkpoint makes no sense"},
        {(size_t)(history - data), 256, 255, "the checkpoint has a wrong length"},
        {8, 8, 9, "made with other settings"},
        {8, 8, size, "the checkpoint is too short"},
    };
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        unsigned char before[8];
        memcpy(before, data + faults[i].at, 8);
        put_word(data + faults[i].at, faults[i].good);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n", NULL);
        put_word(data + faults[i].at, faults[i].bad);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n", faults[i].words);
        memcpy(data + faults[i].at, before, 8);
    }
    unsigned char *reason = data + (list - data) + 8 + 72;
    for (int32_t k = -1; k <= LULL_REASON_COUNT; k++) {
        memcpy(reason, &k, 4);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n",
                      k < 0 || k == LULL_REASON_COUNT ? "block 0 of the checkpoint makes no sense" : NULL);
    }
    expect_answer(path, data, size, r.render, "a=1\nb=3\n", "made with b=2, but this render has b=3");
    expect_answer(path, data, size, r.render, "a=1\nb=", "made with b=2, but this render has b=");
    expect_answer(path, data, size, r.render, "a=1\n", "made with b=2, but this render has no b");
    expect_answer(path, data, size, r.render, "a=1\nb=2\nc=3\n", "made without c, but this render has c=3");
    expect_answer(path, data, (size_t)(history - data) + 4, r.render, "a=1\nb=2\n",
                  "block 0 of the checkpoint makes no sense");
    *reason = 1;
    memset(reason + 1, 0, 3);
    expect_answer(path, data, (size_t)(history - data) + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, (size_t)(drops - data) + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, (size_t)(list - data) + 8 + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, 12, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, 11, r.render, "a=1\nb=2\n", "not a checkpoint");
    data[7] = '2';
    expect_answer(path, data, size, r.render, "a=1\nb=2\n", "not a checkpoint");
    free(bytes);
    release(&r);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_stop_where_the_criterion_says),
        cmocka_unit_test(same_bytes_for_any_threads_and_order),
        cmocka_unit_test(uniform_without_criterion),
        cmocka_unit_test(crop_changes_no_decision),
        cmocka_unit_test(spp_max_ends_a_block),
        cmocka_unit_test(dropped_samples_never_converge_nor_live_for_ever),
        cmocka_unit_test(seams_are_bounded),
        cmocka_unit_test(time_budget_ends_a_render),
        cmocka_unit_test(resumed_render_is_identical),
        cmocka_unit_test(bad_checkpoints_are_refused),
        cmocka_unit_test(slices_deal_out_the_time),
        cmocka_unit_test(rows_are_cut_into_runs),
        cmocka_unit_test(checks_may_be_too_dear),
        cmocka_unit_test(interrupted_blocks_are_asked_once_more),
        cmocka_unit_test(the_order_of_work_follows_its_seed),
        cmocka_unit_test(checkpoints_have_a_layout),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
