/* Whole renders: which block stops where and why, and the same bytes whatever the threads, the order and the crop. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <zlib.h>
#include <cmocka.h>

#include "support/pt_fake.h"

static void blocks_stop_where_the_criterion_says(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 2, "32");
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
    pt_fake_release(&r);
}

static void same_bytes_for_any_threads_and_order(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.planes = PT_FILM_ALL;
    struct pt_fake_run one = pt_fake_render(&config, pt_fake_noise, 1, "32");
    for (uint32_t i = 0; i < one.render->blocks->count; i++)
        assert_int_equal(one.render->blocks->list[i].half_spp, pt_film_half_spp(one.render->blocks->list[i].spp));
    const int threads[] = {2, 3, 8, 3};
    for (int i = 0; i < 4; i++) {
        config.order_seed = i < 3 ? 0 : 99;
        struct pt_fake_run other = pt_fake_render(&config, pt_fake_noise, threads[i], "32");
        pt_fake_assert_same(one.render, other.render);
        pt_fake_release(&other);
    }
    pt_fake_release(&one);
}

static void uniform_without_criterion(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_min = config.spp_max = 50;
    config.uniform = 1;
    int crop[4] = {10, 9, 37, 20};
    memcpy(config.crop, crop, sizeof crop);
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 2, NULL);
    assert_int_equal(r.render->film.pixels, 27 * 11);
    assert_int_equal(r.render->totals->samples, 27 * 11 * 50);
    assert_int_equal(r.render->totals->rays, 3 * 27 * 11 * 50);
    for (uint32_t i = 0; i < r.render->blocks->count; i++)
        assert_true(r.render->blocks->list[i].reason == LULL_REASON_UNIFORM && r.render->blocks->list[i].half_spp == 0);
    pt_fake_release(&r);
}

/* A block is judged whole whatever part of it is kept. */
static void crop_changes_no_decision(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct pt_fake_run whole = pt_fake_render(&config, pt_fake_noise, 2, "32");
    int crop[4] = {20, 20, 30, 25};
    memcpy(config.crop, crop, sizeof crop);
    struct pt_fake_run part = pt_fake_render(&config, pt_fake_noise, 2, "32");
    assert_int_equal(part.render->blocks->count, 1);
    const struct lull_host_block *p = &part.render->blocks->list[0], *w = &whole.render->blocks->list[5];
    assert_int_equal(p->id, 5);
    assert_int_equal(p->spp, w->spp);
    assert_memory_equal(&p->error, &w->error, sizeof p->error);
    assert_int_equal(p->x1 - p->x0, 16);
    pt_fake_release(&whole);
    pt_fake_release(&part);
}

static void spp_max_ends_a_block(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_max = 100;
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 2, "1000");
    for (uint32_t i = 0; i < 12; i++) {
        assert_int_equal(r.render->blocks->list[i].spp, 100);
        assert_int_equal(r.render->blocks->list[i].reason, LULL_REASON_SPP_MAX);
        assert_true(r.render->blocks->list[i].asked);
    }
    pt_fake_release(&r);
}

static void dropped_samples_never_converge_nor_live_for_ever(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    pt_kernel *const kernels[] = {pt_fake_nan, pt_fake_all_nan};
    for (int k = 0; k < 2; k++) {
        struct pt_fake_run r = pt_fake_render(&config, kernels[k], 2, "16");
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
        pt_fake_release(&r);
    }
}

static void seams_are_bounded(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.max_seam = 1.5;
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 2, "32");
    const struct lull_host_blocks *b = r.render->blocks;
    for (uint32_t i = 0; i < b->count; i++) {
        if (i % 4 > 0)
            assert_true((double)b->list[i - 1].spp * 1.5 + 2 >= (double)b->list[i].spp);
        if (i % 4 < 3)
            assert_true((double)b->list[i + 1].spp * 1.5 + 2 >= (double)b->list[i].spp);
    }
    pt_fake_release(&r);
}

static void time_budget_ends_a_render(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    config.spp_max = 1000000;
    config.time_budget_s = 0.05;
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 2, "900000");
    int timed = 0;
    for (uint32_t i = 0; i < 12; i++)
        timed += r.render->blocks->list[i].reason == LULL_REASON_TIME;
    assert_int_equal(timed, 12);
    assert_true(r.render->blocks->list[0].asked);
    assert_true(r.render->blocks->list[0].asked_spp == r.render->blocks->list[0].spp);
    pt_fake_release(&r);
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
