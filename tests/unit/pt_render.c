#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/checkpoint.h"
#include "support/pt_fake.h"

struct result {
    struct pt_render *render;
    struct pt_criterion *criterion;
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
    pt_criterion_destroy(r->criterion);
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
    assert_int_equal(a->blocks.count, b->blocks.count);
    for (uint32_t i = 0; i < a->blocks.count; i++) {
        const struct pt_block *p = &a->blocks.list[i], *q = &b->blocks.list[i];
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
    assert_int_equal(r.render->blocks.count, 12);
    for (uint32_t i = 0; i < 12; i++) {
        const struct pt_block *b = &r.render->blocks.list[i];
        uint64_t at = 32 * (1 + i % 4);
        assert_in_range(b->spp, at, at + at / 5 + 1);
        assert_int_equal(b->reason, PT_REASON_CRITERION);
        assert_true(fabs(b->error - 0.75) < 0.02);
    }
    assert_int_equal(r.render->blocks.list[11].x1, 60);
    assert_int_equal(r.render->blocks.list[11].y1, 44);
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
    assert_int_equal(r.render->totals.samples, 27 * 11 * 50);
    assert_int_equal(r.render->totals.rays, 3 * 27 * 11 * 50);
    for (uint32_t i = 0; i < r.render->blocks.count; i++)
        assert_int_equal(r.render->blocks.list[i].reason, PT_REASON_UNIFORM);
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
    assert_int_equal(part.render->blocks.count, 1);
    const struct pt_block *p = &part.render->blocks.list[0], *w = &whole.render->blocks.list[5];
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
        assert_int_equal(r.render->blocks.list[i].spp, 100);
        assert_int_equal(r.render->blocks.list[i].reason, PT_REASON_SPP_MAX);
        assert_true(r.render->blocks.list[i].asked);
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
        assert_true(r.render->totals.dropped > 0);
        assert_true(r.render->dropped_count > 0);
        assert_true(r.render->dropped[0].x < 8);
        if (k == 0)
            assert_int_equal(r.render->dropped[0].sample % 97, 5);
        for (uint32_t i = 0; i < 12; i++) {
            const struct pt_block *b = &r.render->blocks.list[i];
            assert_int_equal(b->reason, b->x0 < 8 ? PT_REASON_DROPPED : PT_REASON_CRITERION);
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
    const struct pt_blocks *b = &r.render->blocks;
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
};

static int count_down(void *data)
{
    struct stop_after *s = data;
    return --s->slices <= 0;
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
        timed += r.render->blocks.list[i].reason == PT_REASON_TIME;
    assert_int_equal(timed, 12);
    assert_true(r.render->blocks.list[0].asked);
    assert_true(r.render->blocks.list[0].asked_spp == r.render->blocks.list[0].spp);
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
        struct pt_render_hooks hooks = {.interrupted = count_down, .suspend = save, .data = &stop}, none = {0};
        enum pt_render_outcome outcome;
        struct base_err err = {0};
        struct result r = {.pool = base_threads_create(2, &err)};
        struct lull_pair pair = {"at", "32"};
        for (int part = 0; part < 2; part++) {
            assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r.pool, NULL, NULL, &r.criterion, &err), 0);
            assert_int_equal(pt_render_create(&config, NULL, pt_fake_nan, r.pool, r.criterion, &r.render, &err), 0);
            if (part == 1)
                assert_int_equal(pt_checkpoint_load(path, r.render, "a=1\nb=2\n", &err), 0);
            assert_int_equal(pt_render_run(r.render, part == 0 ? &hooks : &none, &outcome, &err), 0);
            assert_int_equal(outcome, part == 0 ? PT_RENDER_INTERRUPTED : PT_RENDER_DONE);
            if (part == 0) {
                pt_render_destroy(r.render);
                pt_criterion_destroy(r.criterion);
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
