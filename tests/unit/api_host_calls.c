/* What the host library tells a criterion, field by field, what becomes of the answers, and what it keeps of both. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <string.h>

#include <cmocka.h>

#include "base/colour.h"
#include "support/api_host_film.h"

/* --- a frame, a view ---------------------------------------------------------------------------------------------------- */

static void a_frame_is_described(void **state)
{
    (void)state;
    static const double xyz[9] = BASE_RGB_TO_XYZ;
    const uint32_t counts = LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT);
    set_up(ALL_PLANES & ~counts, LULL_PLANE_BIT(LULL_PLANE_SPP));
    for (int again = 0; again < 2; again++) {
        const struct lull_host_block *list = begin();
        assert_non_null(list);
        const struct lull_frame *f = &heard.frame;
        assert_int_equal(f->struct_size, sizeof *f);
        assert_int_equal(f->flags, again ? LULL_FRAME_RESTART | LULL_FRAME_INDEPENDENT : LULL_FRAME_DETERMINISTIC);
        assert_true(f->width == 20 && f->height == 14 && f->block_count == 6 && f->block_stride == sizeof(struct lull_rect));
        for (int i = 0; i < 6; i++) {
            const struct lull_host_block *b = &list[i];
            assert_true(heard.rects[i].x0 == b->x0 && heard.rects[i].y0 == b->y0 && heard.rects[i].x1 == b->x1 &&
                        heard.rects[i].y1 == b->y1);
        }
        assert_int_equal(f->planes, ALL_PLANES);
        assert_true(f->transfer == LULL_TRANSFER_SRGB && f->exposure == (again ? 2 : 1) && f->gamma == 0 &&
                    f->sample_clamp == 6);
        assert_true(f->time_budget_s == 2.5 && f->spp_min == 3 && f->spp_max == 90 && f->seed == 77);
        assert_true(again ? f->rgb_to_xyz[4] == 1 && f->rgb_to_xyz[0] == 0 : memcmp(f->rgb_to_xyz, xyz, sizeof xyz) == 0);
        config.flags = LULL_FRAME_INDEPENDENT;
        config.exposure = 2;
        config.rgb_to_xyz[4] = 1;
        lull_host_end(frame);
    }
    frame = NULL;
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; begin 0; begin 0; end 0; destroy 0; ");
}

static void check_plane(int i, const void *data, int channels, int bytes, int type, int normaliser)
{
    const struct lull_plane *p = &heard.planes[i];
    assert_true((!data || p->data == data) && p->data && p->stride_x == channels * bytes &&
                p->stride_y == 12 * channels * bytes);
    assert_true(p->stride_c == bytes && p->scale == 1 && p->type == type && p->normaliser == normaliser &&
                p->channels == (uint32_t)channels);
    assert_int_equal(p->flags, 0);
}

static void a_view_is_described(void **state)
{
    (void)state;
    static const uint32_t due[3] = {1, 2, 4};
    static const uint8_t final[3] = {0, 1, 0};
    struct lull_decision got[3];
    set_up(ALL_PLANES, LULL_PLANE_BIT(LULL_PLANE_SPP));
    heard.answer[1] = (struct lull_decision){.action = LULL_STOP, .error = 1};
    heard.answer[2] = (struct lull_decision){.error = 2};
    heard.answer[4] = (struct lull_decision){.next_spp = 40, .error = 4, .p_noisy = 0.5, .predicted_spp = 60};
    struct lull_host_block *list = begin();
    list[2].reason = LULL_REASON_CRITERION;
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, final, 3, got, &err), LULL_OK);
    assert_true(heard.view.x0 == 8 && heard.view.y0 == 0 && heard.view.x1 == 20 && heard.view.y1 == 14 &&
                heard.view.elapsed_s >= 0);
    assert_true(heard.view.plane_count == LULL_PLANE_COUNT && heard.view.plane_stride == sizeof(struct lull_plane));
    assert_true(heard.view.all_count == 6 && heard.view.all_stride == sizeof(struct lull_block));
    check_plane(LULL_PLANE_COLOR, sums[LULL_PLANE_COLOR], 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_HALF, sums[LULL_PLANE_HALF], 3, 8, LULL_TYPE_F64, LULL_NORM_HALF_SPP);
    check_plane(LULL_PLANE_MOMENT2, sums[LULL_PLANE_MOMENT2], 1, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_DEPTH, sums[LULL_PLANE_DEPTH], 1, 8, LULL_TYPE_F64, LULL_NORM_ONE);
    check_plane(LULL_PLANE_SPP, NULL, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    check_plane(LULL_PLANE_WEIGHT, heard.planes[LULL_PLANE_SPP].data, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    /* pixel (8, 6) is the 72nd of the film */
    assert_true(heard.corner[0] == 1000 + 217 && heard.corner[1] == 5000 + 218 && heard.corner[2] == 4000 + 72);
    assert_true(heard.corner[3] == 7000 + 218 && heard.corner[4] == 8000 + 72 && heard.pixel_spp == 12);
    for (uint32_t i = 0; i < 6; i++) {
        const struct lull_block *b = &heard.all[i];
        const struct lull_host_block *p = &list[i];
        assert_true(b->id == i && b->flags == (i == 2 ? LULL_BLOCK_STOPPED : 0) && b->spp == 10 + i &&
                    b->half_spp == 4 + i / 2);
        assert_true(b->x0 == p->x0 && b->y0 == p->y0 && b->x1 == p->x1 && b->y1 == p->y1 && b->thread_s == 0.5 + i);
    }
    assert_true(heard.count == 3 && heard.due[1].flags == (LULL_BLOCK_STOPPED | LULL_BLOCK_FINAL) &&
                heard.due[2].flags == 0);
    assert_true(heard.preset.action == LULL_CONTINUE && heard.preset.next_spp == 0 && isnan(heard.preset.error) &&
                isnan(heard.preset.p_noisy) && isnan(heard.preset.predicted_spp));
    assert_true(got[0].action == LULL_STOP && got[1].error == 2 && got[2].next_spp == 40 && got[2].p_noisy == 0.5);
    assert_true(lull_host_totals_of(frame)->checks == 0); /* nothing is noted */
    view.x0 = 9;
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 3, got, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "the view 9,0,20,14 does not hold the blocks, 8,0,20,14");
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; begin 0; ask 0 of 1 2! 4; end 0; destroy 0; ");
}

/* Samples that were dropped are made up for: sums are divided by what is in them, and a half buffer is a copy. What the renderer
 * gave stays as it is. */
static void dropped_samples(void **state)
{
    (void)state;
    static const uint32_t due[1] = {2};
    struct lull_decision got[1];
    const uint32_t counts = LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT);
    for (int required = 0; required < 2; required++) {
        set_up(ALL_PLANES & ~counts, required ? LULL_PLANE_BIT(LULL_PLANE_WEIGHT) : 0);
        struct lull_host_block *list = begin(); /* pixel (8, 6) is in block 2, which has 12 samples, 5 of half A */
        lost[72] = 4;
        lost_half[72] = 2;
        lost[73] = 12; /* all of them: it stays black, or whatever its sum says */
        assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
        assert_true(heard.planes[LULL_PLANE_COLOR].normaliser == LULL_NORM_SPP); /* no block dropped any */
        list[2].dropped = 16;
        double before[3] = {sums[LULL_PLANE_COLOR][217], sums[LULL_PLANE_HALF][218], sums[LULL_PLANE_MOMENT2][72]};
        assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
        check_plane(LULL_PLANE_COLOR, sums[LULL_PLANE_COLOR], 3, 8, LULL_TYPE_F64, LULL_NORM_WEIGHT);
        check_plane(LULL_PLANE_MOMENT2, sums[LULL_PLANE_MOMENT2], 1, 8, LULL_TYPE_F64, LULL_NORM_WEIGHT);
        check_plane(LULL_PLANE_NORMAL, sums[LULL_PLANE_NORMAL], 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
        check_plane(LULL_PLANE_WEIGHT, NULL, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
        assert_true(heard.weight[0] == 8 && heard.weight[1] == 12 && heard.pixel_spp == (required ? 12 : -1));
        assert_true(heard.corner[1] == before[1] * (5.0 / 3.0));
        assert_true(sums[LULL_PLANE_COLOR][217] == before[0] && sums[LULL_PLANE_HALF][218] == before[1] &&
                    sums[LULL_PLANE_MOMENT2][72] == before[2]);
        tear_down();
    }
    set_up(ALL_PLANES, 0);
    begin();
    planes[LULL_PLANE_WEIGHT] = lost_plane;
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "a view with a plane WEIGHT counts no dropped samples");
    tear_down();
}

static void what_a_criterion_fails_with(void **state)
{
    (void)state;
    static const uint32_t due[2] = {1, 2};
    struct lull_decision got[2];
    struct lull_host_criterion *none = NULL;
    set_up(ALL_PLANES, 0);
    heard.create = LULL_E_MEMORY;
    released = 0;
    assert_int_equal(lull_host_create(&services, &table, NULL, 0, &none, &err), LULL_E_MEMORY);
    assert_string_equal(err.message, "criterion logger: the moon is full");
    heard.create = LULL_OK;
    heard.require = LULL_E_INVALID;
    assert_int_equal(lull_host_create(&services, &table, NULL, 0, &none, &err), LULL_E_INVALID);
    assert_null(none);
    assert_int_equal(lull_host_open(&services, "/no/such.so", NULL, 0, &none, &err), LULL_E_IO);
    assert_int_equal(released, 3);
    heard.begin = LULL_E_UNSUPPORTED;
    assert_null(begin());
    assert_string_equal(err.message, "criterion logger: the moon is full");
    heard.begin = LULL_OK;
    struct lull_host_block *list = begin();
    assert_false(heard.frame.flags & LULL_FRAME_RESTART); /* the first did not open */
    heard.answer[1] = heard.answer[2] = (struct lull_decision){.action = LULL_STOP, .error = 3};
    heard.evaluate = LULL_E_MEMORY;
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 2, got, &err), LULL_E_MEMORY);
    for (int k = 0; k < 2; k++)
        assert_true(got[k].action == LULL_CONTINUE && got[k].next_spp == 0 && isnan(got[k].error));
    for (int i = 0; i < 6; i++)
        list[i].spp = list[i].next_spp = 20;
    assert_int_equal(lull_host_check(frame, &view, &err), LULL_E_MEMORY); /* costs time, never quality */
    for (int i = 0; i < 6; i++)
        assert_true(list[i].reason == LULL_REASON_NONE && list[i].next_spp == 23 && list[i].checks == 1);
    assert_true(lull_host_totals_of(frame)->failed_checks == 1 && lull_host_totals_of(frame)->checks == 6);
    struct lull_host_criterion *other;
    assert_int_equal((heard.require = LULL_OK, lull_host_create(NULL, &table, NULL, 0, &other, &err)), LULL_OK);
    assert_int_equal(lull_host_evaluate(other, frame, &view, due, NULL, 2, got, &err), LULL_E_STATE);
    assert_string_equal(err.message, "criterion logger: it has not been opened for this frame");
    heard.evaluate = LULL_OK;
    assert_int_equal(lull_host_join(frame, other, &err), LULL_OK);
    assert_int_equal(lull_host_evaluate(other, frame, &view, due, NULL, 2, got, &err), LULL_OK);
    lull_host_close(other);
    tear_down();
    /* blocks of one size only */
    set_up(ALL_PLANES, 0);
    static const struct {
        uint32_t flags, width, height;
        int32_t code;
    } sizes[] = {{0, 8, 6, LULL_OK},
                 {0, 8, 7, LULL_E_UNSUPPORTED},
                 {0, 7, 6, LULL_E_UNSUPPORTED},
                 {LULL_REQ_FLEXIBLE, 7, 7, LULL_OK},
                 {0, 0, 7, LULL_OK},
                 {0, 7, 0, LULL_OK}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        criterion->needs.flags = sizes[i].flags;
        criterion->needs.block_width = sizes[i].width;
        criterion->needs.block_height = sizes[i].height;
        frame = NULL;
        assert_int_equal(lull_host_begin(&config, criterion, &frame, &err), sizes[i].code);
        if (i == 2)
            assert_string_equal(err.message, "criterion logger judges blocks of 7x6 pixels only");
        lull_host_end(frame);
    }
    frame = NULL;
    tear_down();
}

/* --- its memory, what it is offered ------------------------------------------------------------------------------------- */

static void histories(void **state)
{
    (void)state;
    char bytes[20], *end = bytes;
    struct lull_writer writer = {.struct_size = sizeof writer, .context = &end, .write = gather};
    static const unsigned char kept[4] = {7, 8, 9, 10};
    set_up(ALL_PLANES, 0);
    assert_int_equal(lull_host_load_history(criterion, kept, 3, &err), LULL_OK);
    assert_memory_equal(heard.state, kept, 3);
    assert_int_equal(lull_host_load_history(criterion, kept, 4, &err), LULL_E_IO);
    assert_string_equal(err.message, "criterion logger: 1 bytes of its state were left over");
    assert_int_equal(lull_host_load_history(criterion, kept, 2, &err), LULL_E_IO);
    assert_string_equal(err.message, "criterion logger: cannot load its state: cut");
    heard.load = heard.save = LULL_E_MEMORY;
    assert_int_equal(lull_host_load_history(criterion, kept, 3, &err), LULL_E_MEMORY);
    assert_string_equal(err.message, "criterion logger: cannot load its state: the moon is full");
    assert_int_equal(lull_host_save_history(criterion, &writer, &err), LULL_E_MEMORY);
    assert_string_equal(err.message, "criterion logger: cannot save its state: the moon is full");
    struct lull_criterion forgetful = table;
    forgetful.get_extension = NULL;
    criterion->table = &forgetful;
    end = bytes;
    assert_int_equal(lull_host_save_history(criterion, &writer, &err), LULL_OK);
    assert_ptr_equal(end, bytes);
    assert_int_equal(lull_host_load_history(criterion, kept, 0, &err), LULL_OK);
    assert_int_equal(lull_host_load_history(criterion, kept, 1, &err), LULL_E_IO);
    assert_string_equal(err.message, "criterion logger keeps no state, but the checkpoint has one");
    criterion->table = &table;
    tear_down();
}

static void count_task(void *arg, uint64_t task, uint32_t worker)
{
    assert_true(worker < 3);
    ((int *)arg)[task]++;
}

static void offers(void **state)
{
    (void)state;
    struct lull_host_services three = {.struct_size = sizeof three, .threads = 3};
    struct lull_host_criterion *busy = NULL, *silent = NULL;
    set_up(ALL_PLANES, 0);
    assert_int_equal(lull_host_create(&three, &table, NULL, 0, &busy, &err), LULL_OK);
    assert_int_equal(lull_host_create(NULL, &table, NULL, 0, &silent, &err), LULL_OK);
    const struct lull_host *alone = criterion->instances[0]->host, *many = busy->instances[0]->host,
                           *none = silent->instances[0]->host;
    assert_true(alone->struct_size == sizeof *alone && alone->api_minor == LULL_API_MINOR && alone->max_workers == 1 &&
                many->max_workers == 3);
    assert_true(alone->flags == 0 && !alone->cancelled && !alone->get_extension && none->max_workers == 1 && !none->name);
    assert_string_equal(alone->name, "a test");
    alone->log(alone, LULL_LOG_INFO, "psst");
    assert_string_equal(warned, "2: criterion logger: psst");
    alone->log(alone, LULL_LOG_ERROR, "gone");
    assert_string_equal(warned, "0: criterion logger: gone");
    many->log(many, LULL_LOG_ERROR, "nobody hears it");
    assert_string_equal(warned, "0: criterion logger: gone");
    const struct lull_host *hosts[3] = {alone, many, none};
    for (int k = 0; k < 3; k++) {
        int done[20] = {0};
        assert_int_equal(hosts[k]->parallel_for(hosts[k], 19, count_task, done), LULL_OK);
        for (int i = 0; i < 20; i++)
            assert_int_equal(done[i], i < 19);
    }
    lull_host_close(busy);
    lull_host_close(silent);
    tear_down();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_frame_is_described),
        cmocka_unit_test(a_view_is_described),
        cmocka_unit_test(dropped_samples),
        cmocka_unit_test(what_a_criterion_fails_with),
        cmocka_unit_test(histories),
        cmocka_unit_test(offers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
