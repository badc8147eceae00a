/* Frames from their first check to their last: who is asked when, why blocks stop, and what is saved of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "host/frame.h"

/* --- a criterion that answers as it is told ------------------------------------------------------------------------------ */

enum { BLOCKS = 4 };

struct lull_instance {
    uint32_t asked[BLOCKS]; /* its history */
};

static struct lull_decision answer[BLOCKS];
static int32_t evaluate_code;
static uint32_t was_due, was_final; /* masks of blocks */

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                      struct lull_instance **out, struct lull_error *err)
{
    (void)host, (void)pairs, (void)count, (void)stride, (void)err;
    *out = calloc(1, sizeof **out);
    return *out ? LULL_OK : LULL_E_MEMORY;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *needs, struct lull_error *err)
{
    (void)in, (void)err;
    needs->flags = LULL_REQ_FLEXIBLE;
    needs->planes_required = needs->planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR);
    needs->first_spp = 12;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *opened, struct lull_error *err)
{
    (void)opened, (void)err;
    memset(in, 0, sizeof *in);
    return LULL_OK;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    (void)view, (void)block_stride, (void)decision_stride, (void)err;
    for (uint32_t k = 0; k < count; k++) {
        in->asked[blocks[k].id]++;
        was_due |= 1u << blocks[k].id;
        was_final |= blocks[k].flags & LULL_BLOCK_FINAL ? 1u << blocks[k].id : 0;
        decisions[k] = answer[blocks[k].id];
    }
    return evaluate_code;
}

static void end_frame(struct lull_instance *in) { (void)in; }

static void destroy(struct lull_instance *in) { free(in); }

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    (void)err;
    return writer->write(writer, in, sizeof *in);
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    (void)err;
    return reader->read(reader, in, sizeof *in);
}

static const void *get_extension(const char *id)
{
    static const struct lull_state state = {.struct_size = sizeof state, .save = save, .load = load};
    return strcmp(id, LULL_EXT_STATE) == 0 ? &state : NULL;
}

static struct lull_criterion table = {.struct_size = sizeof table,
                                      .id = "told",
                                      .name = "t",
                                      .version = "1",
                                      .description = "d",
                                      .create = create,
                                      .requirements = requirements,
                                      .begin_frame = begin_frame,
                                      .evaluate = evaluate,
                                      .end_frame = end_frame,
                                      .destroy = destroy,
                                      .get_extension = get_extension};

/* --- a frame of 2 x 2 blocks --------------------------------------------------------------------------------------------- */

static float color[8 * 8 * 3];
static const struct lull_plane planes[1] = {{.data = color,
                                             .stride_x = 12,
                                             .stride_y = 96,
                                             .stride_c = 4,
                                             .scale = 1,
                                             .type = LULL_TYPE_F32,
                                             .normaliser = LULL_NORM_SPP,
                                             .channels = 3}};
static const struct lull_host_view view = {.struct_size = sizeof view, .plane_count = 1, .x1 = 8, .y1 = 8, .planes = planes};
static struct lull_host_config config;
static struct lull_host_criterion *criterion;
static struct lull_host_frame *frame;
static struct lull_host_block *list;
static struct lull_host_totals *totals;
static struct lull_error fault;

static void begin(uint32_t capabilities, uint32_t flags)
{
    config = (struct lull_host_config){.struct_size = sizeof config,
                                       .flags = flags,
                                       .width = 8,
                                       .height = 8,
                                       .block_width = 4,
                                       .block_height = 4,
                                       .planes = LULL_PLANE_BIT(LULL_PLANE_COLOR),
                                       .spp_min = 10,
                                       .spp_max = 100};
    fault = (struct lull_error){.struct_size = sizeof fault};
    table.capabilities = capabilities;
    evaluate_code = LULL_OK;
    for (int i = 0; i < BLOCKS; i++)
        answer[i] = lull_host_undecided();
    assert_int_equal(lull_host_create(NULL, &table, NULL, 0, &criterion, &fault), LULL_OK);
    assert_int_equal(lull_host_begin(&config, criterion, &frame, &fault), LULL_OK);
    list = lull_host_blocks_of(frame)->list;
    totals = lull_host_totals_of(frame);
}

static void end(void)
{
    lull_host_end(frame);
    lull_host_close(criterion);
}

/* Every active block gets its samples; who is asked, and who of these for the last time. */
static void check(uint32_t due, uint32_t final)
{
    for (int i = 0; i < BLOCKS; i++)
        list[i].spp = list[i].reason == LULL_REASON_NONE ? list[i].next_spp : list[i].spp;
    was_due = was_final = 0;
    assert_int_equal(lull_host_check(frame, &view, &fault), LULL_OK);
    assert_int_equal(was_due, due);
    assert_int_equal(was_final, final);
}

static void expect(int i, int32_t reason, uint64_t next_spp)
{
    if (list[i].reason != reason || list[i].next_spp != next_spp)
        fail_msg("block %d: reason %d, next %llu", i, list[i].reason, (unsigned long long)list[i].next_spp);
}

static void blocks_stop_one_by_one(void **state)
{
    (void)state;
    begin(0, 0);
    for (int i = 0; i < BLOCKS; i++)
        expect(i, LULL_REASON_NONE, 12); /* where the criterion can say something first */
    answer[0].action = LULL_STOP;
    answer[1].next_spp = 40;
    answer[2] = (struct lull_decision){.action = LULL_STOP, .error = 2, .p_noisy = 0.25, .predicted_spp = 12};
    list[2].dropped = 1;
    check(15, 0);
    expect(0, LULL_REASON_CRITERION, 12);
    expect(1, LULL_REASON_NONE, 40);
    expect(2, LULL_REASON_NONE, 14); /* one STOP is not enough for who dropped samples */
    expect(3, LULL_REASON_NONE, 14);
    assert_true(list[2].asked && list[2].asked_spp == 12 && list[2].error == 2 && list[2].p_noisy == 0.25 &&
                list[2].stop_votes == 1);
    assert_true(totals->checks == 4 && totals->asked == 4 && totals->failed_checks == 0 && totals->criterion_s > 0);
    answer[3].next_spp = 1000; /* beyond the end */
    check(14, 0);
    expect(2, LULL_REASON_DROPPED, 14);
    expect(3, LULL_REASON_NONE, 100);
    check(10, 8); /* all active blocks are asked, whoever is at his last */
    expect(3, LULL_REASON_SPP_MAX, 100);
    answer[1].action = LULL_STOP;
    check(2, 0);
    assert_int_equal(lull_host_active(lull_host_blocks_of(frame)), 0);
    check(0, 0);
    end();
}

/* Open-ended: the checks are those of a frame without a limit, and who is at the limit is asked with all others that are. */
static void open_ended_frames_ask_last_together(void **state)
{
    (void)state;
    begin(0, LULL_HOST_OPEN_ENDED);
    answer[0].next_spp = 1000;
    answer[1].next_spp = 101;
    answer[2].next_spp = 100;
    check(15, 0);
    expect(0, LULL_REASON_NONE, 1000);
    expect(1, LULL_REASON_NONE, 101);
    expect(2, LULL_REASON_NONE, 100);
    for (int i = 0; i < 3; i++)
        list[i].spp = 100;
    list[3].spp = list[3].next_spp;
    answer[3].action = LULL_STOP;
    was_due = was_final = 0;
    assert_int_equal(lull_host_check(frame, &view, &fault), LULL_OK);
    assert_true(was_due == 8 && was_final == 0);
    answer[1].action = LULL_STOP;
    was_due = was_final = 0;
    assert_int_equal(lull_host_check(frame, &view, &fault), LULL_OK);
    assert_true(was_due == 7 && was_final == 7);
    expect(0, LULL_REASON_SPP_MAX, 1000);
    expect(1, LULL_REASON_CRITERION, 101);
    expect(2, LULL_REASON_SPP_MAX, 100);
    end();
}

/* Who is at the limit when time is up is there for the limit. */
static void open_ended_frames_are_stopped(void **state)
{
    (void)state;
    begin(0, LULL_HOST_OPEN_ENDED);
    for (int i = 0; i < BLOCKS; i++) {
        list[i].spp = i < 3 ? 100 : 50;
        list[i].next_spp = 120;
    }
    list[2].asked = 1;
    list[2].asked_spp = 100;
    answer[0].action = LULL_STOP;
    assert_int_equal(lull_host_stop(frame, LULL_REASON_TIME, &view, &fault), LULL_OK);
    expect(0, LULL_REASON_CRITERION, 120);
    expect(1, LULL_REASON_SPP_MAX, 120);
    expect(2, LULL_REASON_SPP_MAX, 120);
    expect(3, LULL_REASON_TIME, 120);
    end();
}

static void nobody_stops_before_the_least(void **state)
{
    (void)state;
    begin(0, 0);
    for (int i = 0; i < BLOCKS; i++) {
        answer[i].action = LULL_STOP;
        list[i].spp = 9;
        list[i].next_spp = 9;
    }
    assert_int_equal(lull_host_check(frame, &view, &fault), LULL_OK);
    for (int i = 0; i < BLOCKS; i++)
        expect(i, LULL_REASON_NONE, 11);
    end();
}

/* A criterion that re-opens is asked about what it stopped as well, but not about what a limit did; nor when nobody is active. */
static void a_criterion_may_reopen(void **state)
{
    (void)state;
    begin(LULL_CAP_REOPENS, 0);
    answer[0].action = LULL_STOP;
    check(15, 0);
    list[1].reason = LULL_REASON_SPP_MAX;
    answer[0].action = LULL_CONTINUE;
    check(13, 0);
    expect(0, LULL_REASON_NONE, 14);
    for (int i = 0; i < BLOCKS; i++)
        list[i].reason = LULL_REASON_CRITERION;
    check(0, 0);
    end();
}

static void seams_are_mended_at_a_check(void **state)
{
    (void)state;
    begin(0, 0);
    frame->config.max_seam = 2;
    answer[0].action = LULL_STOP;
    answer[1].next_spp = 60;
    check(15, 0);
    expect(0, LULL_REASON_CRITERION, 12);
    check(14, 0); /* the block beside it has 60 */
    expect(0, LULL_REASON_NONE, 30);
    end();
}

/* Checks that cost too much are left out, but not the last one of a block. */
static void checks_may_be_too_dear(void **state)
{
    (void)state;
    begin(0, 0);
    frame->config.max_check_overhead = 0.5;
    totals->render_s = 1;
    totals->criterion_s = 3;
    list[3].next_spp = 100;
    check(8, 8);
    assert_true(totals->skipped_checks == 3 && totals->checks == 1);
    for (int i = 0; i < 3; i++)
        expect(i, LULL_REASON_NONE, 14);
    expect(3, LULL_REASON_SPP_MAX, 100);
    totals->render_s = 9;
    check(7, 0);
    end();
}

static void uniform_frames_are_asked_once(void **state)
{
    (void)state;
    begin(LULL_CAP_REOPENS, LULL_HOST_UNIFORM);
    expect(0, LULL_REASON_NONE, 100);
    check(15, 15);
    for (int i = 0; i < BLOCKS; i++)
        expect(i, LULL_REASON_UNIFORM, 100);
    end();
    config.flags = LULL_HOST_UNIFORM;
    assert_int_equal(lull_host_begin(&config, NULL, &frame, &fault), LULL_OK); /* nobody to be asked */
    assert_int_equal(lull_host_check(frame, NULL, &fault), LULL_OK);
    assert_int_equal(lull_host_active(lull_host_blocks_of(frame)), 0);
    assert_int_equal(lull_host_totals_of(frame)->skipped_checks, 0);
    lull_host_end(frame);
}

/* A limit closes who is active; the criterion is asked about those that got samples since the last time. */
static void the_first_limit_wins(void **state)
{
    (void)state;
    begin(0, 0);
    assert_false(lull_host_out_of_time(frame)); /* there is no such limit */
    frame->config.time_budget_s = 5;
    totals->render_s = 3;
    totals->criterion_s = 1.5;
    assert_true(!lull_host_out_of_time(frame) && lull_host_elapsed_s(frame) == 4.5);
    totals->criterion_s = 2;
    assert_true(lull_host_out_of_time(frame));
    list[0].spp = list[1].spp = list[2].spp = 20;
    list[1].asked = 1;
    list[1].asked_spp = 20;
    list[2].reason = LULL_REASON_SPP_MAX;
    answer[0].action = LULL_STOP; /* for the report only */
    answer[0].error = 7;
    was_due = was_final = 0;
    assert_int_equal(lull_host_stop(frame, LULL_REASON_TIME, &view, &fault), LULL_OK);
    assert_true(was_due == 1 && was_final == 1 && list[0].error == 7 && list[0].checks == 1);
    expect(0, LULL_REASON_TIME, 12);
    expect(1, LULL_REASON_TIME, 12);
    expect(2, LULL_REASON_SPP_MAX, 12);
    expect(3, LULL_REASON_TIME, 12);
    end();
    begin(0, 0);
    list[0].spp = 20;
    was_due = 0;
    assert_int_equal(lull_host_stop(frame, LULL_REASON_INTERRUPT, NULL, NULL), LULL_OK); /* no view, no question */
    assert_int_equal(was_due, 0);
    expect(0, LULL_REASON_INTERRUPT, 12);
    end();
}

/* Blocks of very different noise, 1/sqrt(spp): where the time ends, all of it is seen alike, four times less of it where a
 * mask is white. Of block 3 no error is known, as it is with every criterion that tells none. */
static void a_time_budget_goes_where_noise_is_seen_most(void **state)
{
    (void)state;
    static const double noise[BLOCKS] = {100, 10, 40, (double)NAN};
    begin(0, 0);
    frame->config.time_budget_s = 1e9;
    lull_host_blocks_of(frame)->spp_max = 1000000;
    list[1].step = LULL_HOST_STEPS;
    criterion->instances[LULL_HOST_STEPS] = criterion->instances[0];
    uint64_t given = 0, before;
    do {
        before = given;
        for (int i = 0; i < BLOCKS; i++) {
            if (list[i].spp >= list[i].next_spp)
                continue;
            given += list[i].next_spp - list[i].spp;
            assert_true(list[i].spp == 0 ||
                        list[i].next_spp <= list[i].spp + list[i].spp / 2 + 1); /* nobody goes far unasked */
            list[i].spp = list[i].next_spp;
            answer[i].error = noise[i] / sqrt((double)list[i].spp);
            answer[i].next_spp = i < 3 ? 1000000 : 0; /* where it expects to stop */
        }
        assert_true(given > before);
        assert_int_equal(lull_host_check(frame, &view, &fault), LULL_OK);
    } while (given < 200000);
    const double seen[3] = {list[0].error, 4 * list[1].error, list[2].error};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            assert_true(seen[i] <= 1.51 * seen[k]);
    assert_true(list[0].spp > 2 * list[2].spp && list[3].spp > 100);
    criterion->instances[LULL_HOST_STEPS] = NULL;
    end();
}

/* A criterion answers about the frame that was opened last, and about no other. */
static void one_frame_at_a_time(void **state)
{
    (void)state;
    struct lull_host_frame *second;
    begin(0, 0);
    assert_int_equal(lull_host_begin(&config, criterion, &second, &fault), LULL_OK);
    for (int i = 0; i < BLOCKS; i++)
        list[i].spp = lull_host_blocks_of(second)->list[i].spp = 12;
    was_due = 0;
    assert_int_equal(lull_host_check(frame, &view, &fault), LULL_E_STATE);
    assert_string_equal(fault.message, "criterion told: it has not been opened for this frame");
    assert_int_equal(was_due, 0);
    assert_int_equal(lull_host_check(second, &view, &fault), LULL_OK);
    assert_int_equal(was_due, 15);
    lull_host_end(second);
    end();
}

/* --- forecast ------------------------------------------------------------------------------------------------------------- */

static void a_frame_is_forecast(void **state)
{
    (void)state;
    struct lull_host_forecast f;
    begin(0, 0);
    for (int i = 0; i < BLOCKS; i++) {
        list[i].spp = 20;
        list[i].thread_s = 2;
        list[i].asked = 1;
        list[i].asked_spp = 20;
        list[i].next_spp = 40;
        list[i].predicted_spp = 40;
    }
    list[3].reason = LULL_REASON_CRITERION;
    list[2].spp = 30;
    totals->checks = 4;
    totals->criterion_s = 2;
    assert_int_equal(lull_host_forecast_of(lull_host_blocks_of(frame), totals, 1, &f, &fault), LULL_OK);
    assert_true(f.active == 3 && f.known == 1 && f.low == 20 && f.high == 30 && f.done_s == 8);
    assert_true(fabs(f.left_s - (2 + 2 + 2.0 / 3)) < 1e-12 && fabs(f.sampling_s - f.left_s) < 1e-12 &&
                fabs(f.check_s - 1.5) < 1e-12);
    list[1].predicted_spp = (double)NAN;
    assert_int_equal(lull_host_forecast_of(lull_host_blocks_of(frame), totals, 1, &f, &fault), LULL_OK);
    assert_true(f.known == 0 && fabs(f.left_s - (2 + 8 + 2.0 / 3)) < 1e-12);
    for (int i = 0; i < BLOCKS; i++)
        list[i].reason = LULL_REASON_CRITERION;
    assert_int_equal(lull_host_forecast_of(lull_host_blocks_of(frame), totals, 1, &f, &fault), LULL_OK);
    assert_true(f.active == 0 && f.left_s == 0 && f.low > f.high);
    end();
}

/* --- state --------------------------------------------------------------------------------------------------------------- */

struct bytes {
    unsigned char data[4000];
    size_t size;
};

static int32_t gather(const struct lull_writer *writer, const void *data, uint64_t size)
{
    struct bytes *b = writer->context;
    assert_true(b->size + size <= sizeof b->data);
    memcpy(b->data + b->size, data, (size_t)size);
    b->size += (size_t)size;
    return LULL_OK;
}

static int32_t refuse(const struct lull_writer *writer, const void *data, uint64_t size)
{
    (void)writer, (void)data, (void)size;
    return LULL_E_IO;
}

static struct bytes saved(void)
{
    struct bytes b = {.size = 0};
    struct lull_writer writer = {.struct_size = sizeof writer, .context = &b, .write = gather};
    assert_int_equal(lull_host_save(frame, &writer, &fault), LULL_OK);
    return b;
}

/* A frame goes on from its state as it would have without; where halves follow from the samples they are not in it. */
static void states_go_on(void **state)
{
    (void)state;
    for (int known = 0; known < 2; known++) {
        begin(0, known ? LULL_HOST_HALF_KNOWN : 0);
        answer[2].action = LULL_STOP;
        check(15, 0);
        for (uint32_t i = 0; i < BLOCKS; i++) {
            list[i].half_spp = 4 + i;
            list[i].rays = 100 + i;
            list[i].thread_s = 0.5 * i;
        }
        totals->samples = 77;
        lull_host_drop(frame, 1, 2, 3);
        const struct bytes b = saved();
        const struct lull_host_totals before = *totals;
        struct lull_host_block were[BLOCKS];
        memcpy(were, list, sizeof were);
        assert_int_equal(b.size,
                         8 + BLOCKS * 88 + 72 + 8 + 192 + 8 + sizeof(struct lull_instance) + (known ? 0 : 8 * BLOCKS));
        end();
        begin(0, known ? LULL_HOST_HALF_KNOWN : 0);
        assert_int_equal(lull_host_load(frame, b.data, b.size, "x.ckp", &fault), LULL_OK);
        for (int i = 0; i < BLOCKS; i++) {
            were[i].half_spp = known ? 0 : were[i].half_spp;
            assert_memory_equal(&list[i], &were[i], sizeof were[i]);
            assert_int_equal(criterion->instances[0]->asked[i], 1);
        }
        uint32_t kept;
        const struct lull_host_sample *dropped = lull_host_dropped(frame, &kept);
        assert_true(kept == 1 && dropped->x == 1 && dropped->y == 2 && dropped->sample == 3);
        assert_memory_equal(totals, &before, 72);
        assert_true(totals->criterion_thread_s == 0 && totals->asked == 0); /* of this run */
        end();
    }
}

/* Whatever is wrong with it, nothing of it is taken. */
static void bad_states_are_refused(void **state)
{
    (void)state;
    begin(0, 0);
    check(15, 0);
    struct bytes b = saved();
    const size_t history = 8 + BLOCKS * 88 + 72 + 8 + 192;
    const struct {
        size_t at;
        uint64_t value;
        const char *words;
    } faults[] = {
        {0, BLOCKS + 1, "x.ckp: the checkpoint has another number of blocks"},
        {8 + 88 * 3, UINT64_C(1) << 31, "x.ckp: block 3 of the checkpoint makes no sense"},
        {8 + 88 * 2 + 8, UINT64_C(1) << 31, "x.ckp: block 2 of the checkpoint makes no sense"},
        {8 + 72, 7, "x.ckp: block 0 of the checkpoint makes no sense"},
        {8 + BLOCKS * 88 + 72, 17, "x.ckp: the checkpoint makes no sense"},
        {history, sizeof(struct lull_instance) - 1, "x.ckp: the checkpoint has a wrong length"},
        {history, UINT64_MAX, "x.ckp: the checkpoint has a wrong length"},
        {history + 8 + sizeof(struct lull_instance) + 8, 13, "x.ckp: block 1 of the checkpoint makes no sense"}, /* halves */
    };
    end();
    begin(0, 0);
    struct lull_host_block fresh[BLOCKS];
    memcpy(fresh, list, sizeof fresh);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        uint64_t good;
        memcpy(&good, b.data + faults[i].at, 8);
        memcpy(b.data + faults[i].at, &faults[i].value, 8);
        assert_int_equal(lull_host_load(frame, b.data, b.size, "x.ckp", &fault), LULL_E_IO);
        assert_string_equal(fault.message, faults[i].words);
        memcpy(b.data + faults[i].at, &good, 8);
    }
    for (size_t size = 0; size < b.size; size++)
        assert_int_equal(lull_host_load(frame, b.data, size, "x.ckp", &fault), LULL_E_IO);
    assert_memory_equal(list, fresh, sizeof fresh);
    assert_int_equal(totals->checks, 0);
    struct lull_writer writer = {.struct_size = sizeof writer, .write = refuse};
    assert_int_equal(lull_host_save(frame, &writer, &fault), LULL_E_IO);
    assert_string_equal(fault.message, "the state could not be written");
    end();
}

static void identities_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *saved, *present, *words; /* NULL: the same */
    } cases[] = {
        {"", "", NULL},
        {"a=1\nb=2\n", "a=1\nb=2\n", NULL},
        {"a=1\nb=2\n", "b=2\na=1\n", NULL},
        {"a=1\nb=2", "a=1\nb=2\n", NULL},
        {"p=x=1\np=y=2\n", "p=x=1\np=y=2\n", NULL},
        {"p=x=1\np=y=2\n", "p=y=2\np=x=1\n", "made with p=x=1, but this render has p=y=2"}, /* their order may matter */
        {"a=1\nb=2\n", "a=1\nb=3\n", "made with b=2, but this render has b=3"},
        {"a=1\nb=2\n", "a=1\nb=22\n", "made with b=2, but this render has b=22"},
        {"a=1\nb=2\n", "a=1\n", "made with b=2, but this render has no b"},
        {"a=1\n", "a=1\nb=2\n", "made without b, but this render has b=2"},
        {"a=1\na=1\n", "a=1\n", "made with a=1, but this render has no a"},
        {"a\n", "a\n", NULL},
        {"a=1\033[2J\n", "a=1\n", "made with other settings"},
        {"a=\xc0\xaf\n", "a=1\n", "made with other settings"},
        {"a=\xc3\xa9\n", "a=1\n", "made with a=\xc3\xa9, but this render has a=1"},
    };
    char line[200];
    fault = (struct lull_error){.struct_size = sizeof fault};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        int32_t code = lull_host_same_identity(cases[i].saved, strlen(cases[i].saved), cases[i].present, "x.ckp", &fault);
        assert_int_equal(code, cases[i].words ? LULL_E_VALUE : LULL_OK);
        snprintf(line, sizeof line, "x.ckp: %s", cases[i].words ? cases[i].words : "");
        if (cases[i].words)
            assert_string_equal(fault.message, line);
    }
}

/* --- report -------------------------------------------------------------------------------------------------------------- */

/* The writer gets what the file would hold; what nobody counts is null. */
static void reports_as_text(void **state)
{
    (void)state;
    begin(0, 0);
    struct bytes b = {.size = 0};
    struct lull_writer writer = {.struct_size = sizeof writer, .context = &b, .write = gather};
    struct lull_host_report report = {.struct_size = sizeof report,
                                      .flags = LULL_REPORT_NO_RAYS,
                                      .processes = 1,
                                      .film_pixels = 64,
                                      .scene_bytes = (double)NAN,
                                      .phases = &(struct lull_host_phase){"copies_s", 1.5},
                                      .phase_count = 1};
    frame->blocks.count = 1; /* short */
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_OK);
    frame->blocks.count = BLOCKS;
    b.data[b.size] = '\0';
    const char *text = (const char *)b.data;
    assert_non_null(strstr(text, "\"scene\":\tnull"));
    assert_non_null(strstr(text, "\"rays\":\tnull"));
    assert_non_null(strstr(text, "\"id\":\t\"told\""));
    assert_null(strstr(text, "messages"));
    assert_non_null(strstr(text, "\"command\""));
    assert_non_null(strstr(text, "\"copies_s\":\t1.5"));
    report.struct_size = offsetof(struct lull_host_report, software); /* as version 1.0 has it */
    b.size = 0;
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_OK);
    b.data[b.size] = '\0';
    assert_null(strstr(text, "\"command\""));
    report.struct_size--;
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_E_VERSION);
    report.struct_size = sizeof report;
    writer.write = refuse;
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_E_IO);
    end();
}

/* What a criterion says in a frame stands in the report: the first lines, each once, nothing of LULL_LOG_DEBUG, nothing of another frame. */
static void messages_in_reports(void **state)
{
    (void)state;
    char line[32];
    struct bytes b = {.size = 0};
    struct lull_writer writer = {.struct_size = sizeof writer, .context = &b, .write = gather};
    struct lull_host_report report = {
        .struct_size = sizeof report, .processes = 1, .film_pixels = 64, .scene_bytes = (double)NAN};
    begin(0, 0);
    lull_host_say(criterion, LULL_LOG_DEBUG, "chatter");
    lull_host_say(criterion, LULL_LOG_INFO, "news");
    for (int i = 0; i < 4 * LULL_HOST_MESSAGES; i++) { /* each twice */
        snprintf(line, sizeof line, i / 2 < LULL_HOST_MESSAGES - 1 ? "trouble %d" : "too much %d", i / 2);
        lull_host_say(criterion, LULL_LOG_WARNING, line);
    }
    frame->blocks.count = 1; /* short */
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_OK);
    b.data[b.size] = '\0';
    const char *text = (const char *)b.data, *last = NULL;
    assert_non_null(strstr(text, "\"messages\":\t[\"criterion told: news\", \"criterion told: trouble 0\", "));
    assert_null(strstr(text, "chatter"));
    assert_null(strstr(text, "too much"));
    int count = 0;
    for (last = strstr(text, "trouble"); last; last = strstr(last + 1, "trouble"))
        count++;
    assert_int_equal(count, LULL_HOST_MESSAGES - 1);
    frame->blocks.count = BLOCKS;
    lull_host_end(frame);
    assert_int_equal(lull_host_begin(&config, criterion, &frame, &fault), LULL_OK);
    frame->blocks.count = 1;
    b.size = 0;
    assert_int_equal(lull_host_report_text(frame, &report, &writer, &fault), LULL_OK);
    b.data[b.size] = '\0';
    assert_null(strstr(text, "messages"));
    frame->blocks.count = BLOCKS;
    end();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_stop_one_by_one),
        cmocka_unit_test(open_ended_frames_ask_last_together),
        cmocka_unit_test(open_ended_frames_are_stopped),
        cmocka_unit_test(nobody_stops_before_the_least),
        cmocka_unit_test(a_criterion_may_reopen),
        cmocka_unit_test(seams_are_mended_at_a_check),
        cmocka_unit_test(checks_may_be_too_dear),
        cmocka_unit_test(uniform_frames_are_asked_once),
        cmocka_unit_test(the_first_limit_wins),
        cmocka_unit_test(a_time_budget_goes_where_noise_is_seen_most),
        cmocka_unit_test(one_frame_at_a_time),
        cmocka_unit_test(a_frame_is_forecast),
        cmocka_unit_test(states_go_on),
        cmocka_unit_test(bad_states_are_refused),
        cmocka_unit_test(identities_by_name),
        cmocka_unit_test(reports_as_text),
        cmocka_unit_test(messages_in_reports),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
