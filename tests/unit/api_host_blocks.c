/* How the host library lays out blocks, when each is checked next, which are opened again, and which configs it refuses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdlib.h>

#include <cmocka.h>

#include "support/api_host_film.h"

static void grids(void **state)
{
    (void)state;
    static const int rects[6][5] = {{1, 8, 0, 16, 6},   {2, 16, 0, 20, 6},  {4, 8, 6, 16, 12},
                                    {5, 16, 6, 20, 12}, {7, 8, 12, 16, 14}, {8, 16, 12, 20, 14}};
    set_up(ALL_PLANES, 0);
    for (int clip = 0; clip < 2; clip++) { /* without a criterion */
        config.flags = clip ? LULL_HOST_UNIFORM : 0;
        assert_int_equal(lull_host_begin(&config, clip ? NULL : criterion, &frame, &err), LULL_OK);
        const struct lull_host_blocks *b = lull_host_blocks_of(frame);
        assert_true(b->count == 6 && b->columns == 3 && b->rows == 3 && b->list_columns == 2 && b->block_width == 8 &&
                    b->block_height == 6);
        assert_true(b->struct_size == sizeof *b && b->spp_min == 3 && b->spp_max == 90 && b->check_step == 1);
        for (int i = 0; i < 6; i++) {
            const struct lull_host_block *p = &b->list[i];
            const int *r = rects[i];
            assert_true(p->id == (uint32_t)r[0] && p->x0 == (clip && r[1] < 9 ? 9 : r[1]) &&
                        p->y0 == (clip && r[2] < 1 ? 1 : r[2]));
            assert_true(p->x1 == r[3] && p->y1 == (clip && r[4] > 13 ? 13 : r[4]));
            assert_true(isnan(p->p_noisy) && isnan(p->error) && isnan(p->predicted_spp) && p->spp == 0 &&
                        p->reason == LULL_REASON_NONE);
            assert_int_equal(p->next_spp, clip ? 90 : 3);
        }
        assert_true(b->x0 == (clip ? 9 : 8) && b->y0 == clip && b->x1 == 20 && b->y1 == (clip ? 13 : 14));
        lull_host_end(frame);
    }
    config = (struct lull_host_config){.struct_size = sizeof config,
                                       .width = 16,
                                       .height = 6,
                                       .block_width = 8,
                                       .block_height = 6,
                                       .spp_min = 1,
                                       .spp_max = 9}; /* whole blocks, no crop: one column is not two */
    assert_int_equal(lull_host_begin(&config, criterion, &frame, &err), LULL_OK);
    assert_true(lull_host_blocks_of(frame)->count == 2 && lull_host_blocks_of(frame)->columns == 2 &&
                lull_host_blocks_of(frame)->rows == 1);
    lull_host_end(frame);
    frame = NULL;
    tear_down();
    static const char *const names[] = {"none", "criterion", "spp-max", "uniform", "time", "interrupt", "dropped"};
    for (int i = 0; i < LULL_REASON_COUNT; i++)
        assert_string_equal(lull_host_reason(i), names[i]);
    assert_string_equal(lull_host_reason(LULL_REASON_COUNT), "unknown");
    assert_string_equal(lull_host_reason(-1), "unknown");
}

/* Nobody says how large: as the criterion was made, but at least 12 blocks of 16 pixels or more, even ones if there are. */
static void blocks_by_default(void **state)
{
    (void)state;
    static const struct {
        uint32_t width, height, own, flags, size;
    } cases[] = {{1920, 1080, 0, LULL_REQ_FLEXIBLE, 200},   {640, 480, 0, LULL_REQ_FLEXIBLE, 200},
                 {240, 160, 0, LULL_REQ_FLEXIBLE, 64},      {512, 512, 0, LULL_REQ_FLEXIBLE, 146},
                 {100, 60, 200, LULL_REQ_FLEXIBLE, 22},     {8, 8, 0, LULL_REQ_FLEXIBLE, 16},
                 {1920, 1080, 100, LULL_REQ_FLEXIBLE, 100}, {240, 160, 100, 0, 100},
                 {240, 160, 8, LULL_REQ_FLEXIBLE, 8}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        set_up(ALL_PLANES, 0);
        criterion->needs.flags = cases[i].flags;
        criterion->needs.block_width = criterion->needs.block_height = cases[i].own;
        config = (struct lull_host_config){
            .struct_size = sizeof config, .width = cases[i].width, .height = cases[i].height, .spp_min = 1, .spp_max = 9};
        struct lull_host_blocks blocks = {0};
        assert_int_equal(lull_host_lay_out(&config, &criterion->needs, 0, &blocks, &err), LULL_OK);
        assert_true(blocks.block_width == (int32_t)cases[i].size && blocks.block_height == (int32_t)cases[i].size);
        free(blocks.list);
        tear_down();
    }
}

/* Any rectangles: they keep their order, and who touches whom is seen. */
static void layouts_of_ones_own(void **state)
{
    (void)state;
    struct {
        struct lull_rect r;
        int32_t more[2];
    } layout[4] = {{.r = {4, 0, 8, 4}}, {.r = {0, 0, 4, 8}}, {.r = {4, 4, 8, 8}}, {.r = {10, 9, 12, 10}}};
    set_up(ALL_PLANES, 0);
    config = (struct lull_host_config){.struct_size = sizeof config,
                                       .width = 12,
                                       .height = 10,
                                       .layout = &layout[0].r,
                                       .layout_count = 4,
                                       .layout_stride = sizeof layout[0],
                                       .spp_min = 1,
                                       .spp_max = 1000};
    assert_int_equal(lull_host_begin(&config, criterion, &frame, &err), LULL_OK);
    struct lull_host_blocks *b = lull_host_blocks_of(frame);
    assert_true(b->count == 4 && b->columns == 0 && b->x0 == 0 && b->y0 == 0 && b->x1 == 12 && b->y1 == 10);
    static const uint64_t spp[4] = {100, 10, 10, 10}, next[4] = {1, 50, 50, 1};
    for (uint32_t i = 0; i < 4; i++) {
        assert_true(b->list[i].id == i && b->list[i].x0 == layout[i].r.x0 && b->list[i].y1 == layout[i].r.y1);
        assert_true(heard.rects[i].x0 == layout[i].r.x0 && heard.rects[i].y1 == layout[i].r.y1);
        b->list[i].spp = spp[i];
        b->list[i].reason = LULL_REASON_CRITERION;
    }
    assert_int_equal(lull_host_reopen(b, 2.0), 2); /* the last touches nobody */
    for (int i = 0; i < 4; i++)
        assert_int_equal(b->list[i].next_spp, next[i]);
    lull_host_end(frame);
    frame = NULL;
    layout[2].r.y1 = 11;
    assert_int_equal(lull_host_begin(&config, criterion, &frame, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "block 2 (4,4,8,11) must lie inside 12x10 pixels and not be empty");
    tear_down();
}

static void next_checks_and_seams(void **state)
{
    (void)state;
    static const uint64_t cases[][5] = {
        {100, 0, 1000, 115, 1}, {100, 101, 1000, 101, 1}, {100, 100, 1000, 115, 1}, {3, 0, 99, 4, 1},   {1, 0, 99, 2, 1},
        {100, 0, 114, 114, 1},  {100, 500, 200, 200, 1},  {0, 0, 9, 1, 1},          {20, 0, 99, 23, 1}, {20, 0, 99, 32, 16},
        {20, 64, 99, 64, 16},   {90, 0, 99, 99, 16},      {20, 0, 99, 23, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct lull_host_blocks b = {.spp_max = cases[i][2], .check_step = cases[i][4]};
        assert_int_equal(lull_host_next_check(&b, cases[i][0], cases[i][1]), cases[i][3]);
    }
    /* two rows of three: most samples stand at the upper right */
    struct lull_host_block list[6];
    struct lull_host_blocks b = {.list = list, .count = 6, .list_columns = 3, .spp_max = 100};
    static const uint64_t spp[6] = {10, 20, 100, 30, 25, 50}, need[6] = {0, 50, 0, 0, 0, 0};
    for (int from = 0; from < 2; from++) {
        for (int i = 0; i < 6; i++)
            list[i] = (struct lull_host_block){
                .spp = spp[i], .next_spp = 7, .reason = from ? LULL_REASON_DROPPED : LULL_REASON_CRITERION};
        list[0].reason = LULL_REASON_SPP_MAX; /* has what it may have */
        assert_int_equal(lull_host_reopen(&b, 2.0), 1);
        for (int i = 0; i < 6; i++) {
            assert_int_equal(list[i].reason == LULL_REASON_NONE, need[i] > 0);
            assert_int_equal(list[i].next_spp, need[i] > 0 ? need[i] : 7);
        }
    }
    for (int i = 0; i < 6; i++)
        list[i].reason = LULL_REASON_CRITERION;
    assert_int_equal(lull_host_reopen(&b, 1.5), 4); /* 10 by 30, 20 by 100, 25 by 50, 50 by 100; 30 stays by 25 */
    assert_true(list[0].next_spp == 20 && list[1].next_spp == 67 && list[4].next_spp == 34 && list[5].next_spp == 67);
    assert_true(list[3].reason == LULL_REASON_CRITERION);
    b.check_step = 16;
    list[1].reason = list[5].reason = LULL_REASON_CRITERION;
    assert_int_equal(lull_host_reopen(&b, 1.5), 2);
    assert_true(list[1].next_spp == 80 && list[5].next_spp == 80);
}

/* With higher limits than those that closed them blocks go on; what the criterion stopped stays. */
static void closed_blocks_are_extended(void **state)
{
    (void)state;
    struct lull_host_block list[LULL_REASON_COUNT];
    struct lull_host_blocks b = {.list = list, .count = LULL_REASON_COUNT, .spp_max = 99, .check_step = 16};
    for (int i = 0; i < LULL_REASON_COUNT; i++)
        list[i] = (struct lull_host_block){
            .reason = i, .spp = i == LULL_REASON_INTERRUPT ? 99 : 20, .next_spp = i == LULL_REASON_TIME ? 40 : 20};
    assert_int_equal(lull_host_extend(&b), 3);
    static const uint64_t next[LULL_REASON_COUNT] = {20, 20, 32, 32, 48, 20, 20};
    for (int i = 0; i < LULL_REASON_COUNT; i++) {
        int open = i == LULL_REASON_NONE || i == LULL_REASON_SPP_MAX || i == LULL_REASON_UNIFORM || i == LULL_REASON_TIME;
        assert_true((list[i].reason == LULL_REASON_NONE) == open && list[i].next_spp == next[i]);
    }
    /* A uniform frame has one check; one with a lower limit gets no more samples. */
    static const uint64_t limits[3] = {10, 20, 90};
    for (int k = 0; k < 6; k++) {
        struct lull_host_block one = {.reason = k % 2 ? LULL_REASON_UNIFORM : LULL_REASON_NONE, .spp = 20, .next_spp = 50};
        b = (struct lull_host_blocks){.list = &one, .count = 1, .spp_max = limits[k / 2], .flags = LULL_HOST_UNIFORM};
        assert_int_equal(lull_host_extend(&b), k == 5);
        assert_int_equal(one.next_spp, k / 2 == 2 ? 90 : 20);
        one = (struct lull_host_block){.spp = 20, .next_spp = 50};
        b.flags = 0;
        assert_int_equal(lull_host_extend(&b), 0);
        assert_int_equal(one.next_spp, k / 2 == 2 ? 50 : 20);
    }
}

static void configs_that_make_no_sense(void **state)
{
    (void)state;
    set_up(ALL_PLANES, 0);
    const struct lull_host_config good = config;
    static const struct {
        uint32_t size_less, width, block;
        int32_t crop_end;
        uint64_t spp_min, spp_max;
        double seam;
        int32_t code;
        const char *words;
    } cases[] = {
        {8, 20, 8, 20, 3, 90, 0, LULL_E_VERSION, "the config is smaller than in version 1.0"},
        {0, 0, 8, 20, 3, 90, 0, LULL_E_INVALID, "a picture of 0x14 pixels: expected 1 to 2^31 - 1"},
        {0, 20, UINT32_MAX, 20, 3, 90, 0, LULL_E_INVALID, "blocks of 4294967295x6 pixels are too large"},
        {0, 20, 8, 21, 3, 90, 0, LULL_E_INVALID, "crop 9,1,21,13: it must lie inside 20x14 pixels and not be empty"},
        {0, 20, 8, 9, 3, 90, 0, LULL_E_INVALID, "crop 9,1,9,13: it must lie inside 20x14 pixels and not be empty"},
        {0, 20, 8, 20, 0, 90, 0, LULL_E_INVALID, "spp_min 0, spp_max 90: expected 1 <= spp_min <= spp_max < 2^31"},
        {0, 20, 8, 20, 91, 90, 0, LULL_E_INVALID, "spp_min 91, spp_max 90: expected 1 <= spp_min <= spp_max < 2^31"},
        {0, 20, 8, 20, 3, UINT64_C(1) << 31, 0, LULL_E_INVALID,
         "spp_min 3, spp_max 2147483648: expected 1 <= spp_min <= spp_max < 2^31"},
        {0, 20, 8, 20, 3, 90, 0.5, LULL_E_INVALID, "max_seam 0.5: expected 0 or at least 1"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        config = good;
        config.struct_size -= cases[i].size_less;
        config.width = cases[i].width;
        config.block_width = cases[i].block;
        config.crop[2] = cases[i].crop_end;
        config.spp_min = cases[i].spp_min;
        config.spp_max = cases[i].spp_max;
        config.max_seam = cases[i].seam;
        assert_int_equal(lull_host_begin(&config, criterion, &frame, &err), cases[i].code);
        assert_string_equal(err.message, cases[i].words);
    }
    config = good;
    assert_int_equal(lull_host_begin(&config, NULL, &frame, &err), LULL_E_INVALID); /* nobody says when */
    frame = NULL;
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; destroy 0; ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grids),
        cmocka_unit_test(blocks_by_default),
        cmocka_unit_test(layouts_of_ones_own),
        cmocka_unit_test(next_checks_and_seams),
        cmocka_unit_test(closed_blocks_are_extended),
        cmocka_unit_test(configs_that_make_no_sense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
