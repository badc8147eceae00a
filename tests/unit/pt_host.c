/* What the host tells a criterion, field by field, and what becomes of the answers; what it keeps of one in a checkpoint. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "base/png.h"
#include "base/version.h"
#include "render/host_find.h"
#include "render/host_planes.h"
#include "render/host_state.h"
#include "render/mask.h"
#include "support/api_folders.h"
#include "support/pt_approve.h"
#include "support/pt_fake.h"

/* --- a criterion that writes everything down ---------------------------------------------------------------------------- */

enum { MOST = 16, ALL_PLANES = LULL_PLANE_BIT(LULL_PLANE_COUNT) - 1 };

struct lull_instance {
    double dial;
    const struct lull_host *host;
};

static struct {
    struct lull_requirements needs;
    struct lull_decision answer[MOST]; /* by block */
    int32_t create, require, begin, evaluate, save, load; /* to be answered */
    char calls[400];
    struct lull_frame frame;
    struct lull_rect rects[MOST];
    struct lull_view view;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block all[MOST], due[MOST];
    uint32_t count;
    double corner[5], pixel_spp; /* of pixel (8, 6) as the planes have it */
    struct lull_decision preset;
    unsigned char state[8];
} heard;

static void note(const char *format, ...)
{
    size_t n = strlen(heard.calls);
    va_list args;
    va_start(args, format);
    vsnprintf(heard.calls + n, sizeof heard.calls - n, format, args);
    va_end(args);
}

static int32_t said(int32_t code, struct lull_error *err)
{
    if (code != LULL_OK) {
        err->code = code;
        strcpy(err->message, "the moon is full");
    }
    return code;
}

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride, struct lull_instance **out,
                      struct lull_error *err)
{
    if (heard.create != LULL_OK)
        return said(heard.create, err);
    struct lull_instance *in = calloc(1, sizeof *in);
    assert_true(in && stride == sizeof *pairs);
    in->host = host;
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(pairs[i].key, "threshold") == 0)
            in->dial = strtod(pairs[i].value, NULL);
    note("create %g of %u; ", in->dial, count);
    *out = in;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *needs, struct lull_error *err)
{
    assert_int_equal(needs->struct_size, sizeof *needs);
    (void)in;
    *needs = heard.needs;
    return said(heard.require, err);
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    heard.frame = *frame;
    memcpy(heard.rects, frame->blocks, frame->block_count * sizeof *frame->blocks);
    note("begin %g; ", in->dial);
    return said(heard.begin, err);
}

static double at(const struct lull_view *view, int plane, int x, int y, int channel)
{
    const struct lull_plane *p = &view->planes[plane];
    const char *data = p->data;
    data += (x - view->x0) * p->stride_x + (y - view->y0) * p->stride_y + channel * p->stride_c;
    return p->type == LULL_TYPE_U32 ? (double)*(const uint32_t *)(const void *)data : *(const double *)(const void *)data;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks, uint32_t block_stride,
                        struct lull_decision *decisions, uint32_t decision_stride, uint32_t count, struct lull_error *err)
{
    assert_true(block_stride == sizeof *blocks && decision_stride == sizeof *decisions);
    heard.view = *view;
    memcpy(heard.planes, view->planes, sizeof heard.planes);
    memcpy(heard.all, view->all, view->all_count * sizeof *view->all);
    memcpy(heard.due, blocks, count * sizeof *blocks);
    heard.count = count;
    heard.preset = decisions[0];
    heard.corner[0] = at(view, LULL_PLANE_COLOR, 8, 6, 1);
    heard.corner[1] = at(view, LULL_PLANE_HALF, 8, 6, 2);
    heard.corner[2] = at(view, LULL_PLANE_MOMENT2, 8, 6, 0);
    heard.corner[3] = at(view, LULL_PLANE_NORMAL, 8, 6, 2);
    heard.corner[4] = at(view, LULL_PLANE_DEPTH, 8, 6, 0);
    heard.pixel_spp = view->planes[LULL_PLANE_SPP].data ? at(view, LULL_PLANE_SPP, 8, 6, 0) : -1;
    note("ask %g of", in->dial);
    for (uint32_t k = 0; k < count; k++) {
        note(" %u%s", blocks[k].id, blocks[k].flags & LULL_BLOCK_FINAL ? "!" : "");
        decisions[k] = heard.answer[blocks[k].id];
    }
    note("; ");
    return said(heard.evaluate, err);
}

static void end_frame(struct lull_instance *in)
{
    note("end %g; ", in->dial);
}

static void destroy(struct lull_instance *in)
{
    note("destroy %g; ", in->dial);
    free(in);
}

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    unsigned char bytes[3] = {1, 2, (unsigned char)(16 * in->dial)};
    assert_int_equal(writer->write(writer, bytes, 1), LULL_OK);
    assert_int_equal(writer->write(writer, bytes, 0), LULL_OK);
    assert_int_equal(writer->write(writer, bytes + 1, 2), LULL_OK);
    return said(heard.save, err);
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    (void)in;
    memset(heard.state, 0, sizeof heard.state);
    int32_t code = reader->read(reader, heard.state, 2);
    if (code == LULL_OK)
        code = reader->read(reader, heard.state + 2, 1);
    if (code != LULL_OK)
        strcpy(err->message, "cut");
    return code == LULL_OK ? said(heard.load, err) : code;
}

static const void *get_extension(const char *id)
{
    static const struct lull_state state = {.struct_size = sizeof state, .save = save, .load = load};
    return strcmp(id, LULL_EXT_STATE) == 0 ? &state : NULL;
}

static const struct lull_param parameters[] = {
    {.name = "visible", .help = "h", .min = 0.001, .max = 1, .type = LULL_PARAM_FLOAT},
    {.name = "threshold", .help = "h", .default_value = "0.5", .min = 0.25, .max = 4, .type = LULL_PARAM_FLOAT}};
static struct lull_criterion table = {.struct_size = sizeof table, .id = "logger", .name = "l", .version = "3", .description = "d",
                                      .params = parameters, .param_count = 2, .param_stride = sizeof parameters[0],
                                      .create = create, .requirements = requirements, .begin_frame = begin_frame, .evaluate = evaluate,
                                      .end_frame = end_frame, .destroy = destroy, .get_extension = get_extension};

/* --- a film with blocks ------------------------------------------------------------------------------------------------- */

static struct pt_blocks blocks;
static struct pt_film film;
static struct pt_criterion *criterion;
static struct pt_criterion_frame frame;
static char warned[700];

static void warn(void *data, const char *line)
{
    assert_ptr_equal(data, &frame);
    strcpy(warned, line);
}

/* 20 x 14 pixels in blocks of 8 x 6, of which a crop touches the last two columns; every sum of its own. */
static void set_up(uint32_t planes, uint32_t required)
{
    static const int crop[4] = {9, 1, 20, 13};
    struct base_err err = {0};
    memset(&heard, 0, sizeof heard);
    heard.needs = (struct lull_requirements){.struct_size = sizeof heard.needs, .flags = LULL_REQ_FLEXIBLE, .planes_required = required,
                                             .planes_used = ALL_PLANES};
    frame = (struct pt_criterion_frame){.width = 20, .height = 14, .spp_min = 3, .spp_max = 90, .seed = 77, .time_budget_s = 2.5,
                                        .sample_clamp = 6, .deterministic = 1};
    assert_int_equal(pt_blocks_init(&blocks, 20, 14, 8, 6, crop, 0, &err), 0);
    assert_int_equal(pt_film_init(&film, blocks.x0, blocks.y0, blocks.x1, blocks.y1, planes, &err), 0);
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&film, arrays);
    for (int k = 0; k < n; k++)
        for (size_t i = 0; arrays[k].bytes >= 8 * film.pixels && i < arrays[k].bytes / 8; i++)
            ((double *)arrays[k].data)[i] = 1000.0 * (k + 1) + (double)i;
    for (uint32_t i = 0; i < blocks.count; i++) {
        blocks.list[i].spp = 10 + i;
        blocks.list[i].thread_s = 0.5 + i;
    }
    blocks.list[2].reason = PT_REASON_CRITERION;
    assert_int_equal(pt_criterion_create(&table, NULL, 0, NULL, warn, &frame, &criterion, &err), 0);
}

static void tear_down(void)
{
    pt_criterion_destroy(criterion);
    pt_film_release(&film);
    pt_blocks_release(&blocks);
}

static void grids(void **state)
{
    (void)state;
    static const int crop[4] = {9, 1, 20, 13}, rects[6][5] = {{1, 8, 0, 16, 6},  {2, 16, 0, 20, 6},  {4, 8, 6, 16, 12},
                                                              {5, 16, 6, 20, 12}, {7, 8, 12, 16, 14}, {8, 16, 12, 20, 14}};
    struct pt_blocks b;
    struct base_err err = {0};
    for (int clip = 0; clip < 2; clip++) {
        assert_int_equal(pt_blocks_init(&b, 20, 14, 8, 6, crop, clip, &err), 0);
        assert_true(b.count == 6 && b.columns == 3 && b.rows == 3 && b.list_columns == 2 && b.block_width == 8 && b.block_height == 6);
        for (int i = 0; i < 6; i++) {
            const struct pt_block *p = &b.list[i];
            const int *r = rects[i];
            assert_true(p->id == (uint32_t)r[0] && p->x0 == (clip && r[1] < 9 ? 9 : r[1]) && p->y0 == (clip && r[2] < 1 ? 1 : r[2]));
            assert_true(p->x1 == r[3] && p->y1 == (clip && r[4] > 13 ? 13 : r[4]));
            assert_true(isnan(p->p_noisy) && isnan(p->error) && isnan(p->predicted_spp) && p->spp == 0 && p->reason == PT_REASON_NONE);
        }
        assert_true(b.x0 == (clip ? 9 : 8) && b.y0 == clip && b.x1 == 20 && b.y1 == (clip ? 13 : 14));
        pt_blocks_release(&b);
    }
    static const int whole[4] = {0, 0, 16, 6}; /* whole blocks: one column is not two */
    assert_int_equal(pt_blocks_init(&b, 16, 6, 8, 6, whole, 0, &err), 0);
    assert_true(b.count == 2 && b.columns == 2 && b.rows == 1);
    pt_blocks_release(&b);
    static const char *const names[] = {"none", "criterion", "spp-max", "uniform", "time", "interrupt", "dropped"};
    for (int i = 0; i < PT_REASON_COUNT; i++)
        assert_string_equal(pt_block_reason_name(i), names[i]);
    assert_string_equal(pt_block_reason_name(PT_REASON_COUNT), "unknown");
    assert_string_equal(pt_block_reason_name(-1), "unknown");
}

static void next_checks_and_seams(void **state)
{
    (void)state;
    static const uint64_t cases[][4] = {{100, 0, 1000, 115}, {100, 101, 1000, 101}, {100, 100, 1000, 115}, {3, 0, 99, 4}, {1, 0, 99, 2},
                                        {100, 0, 114, 114},  {100, 500, 200, 200},  {0, 0, 9, 1},          {20, 0, 99, 23}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(pt_blocks_next_check(cases[i][0], cases[i][1], cases[i][2]), cases[i][3]);
    /* two rows of three: most samples stand at the upper right */
    struct pt_block list[6];
    struct pt_blocks b = {.list = list, .count = 6, .list_columns = 3};
    static const uint64_t spp[6] = {10, 20, 100, 30, 25, 50}, need[6] = {0, 50, 0, 0, 0, 0};
    for (int from = 0; from < 2; from++) {
        for (int i = 0; i < 6; i++)
            list[i] = (struct pt_block){.spp = spp[i], .next_spp = 7, .reason = from ? PT_REASON_DROPPED : PT_REASON_CRITERION};
        list[0].reason = PT_REASON_SPP_MAX; /* has what it may have */
        assert_int_equal(pt_blocks_reopen(&b, 2.0), 1);
        for (int i = 0; i < 6; i++) {
            assert_int_equal(list[i].reason == PT_REASON_NONE, need[i] > 0);
            assert_int_equal(list[i].next_spp, need[i] > 0 ? need[i] : 7);
        }
    }
    for (int i = 0; i < 6; i++)
        list[i].reason = PT_REASON_CRITERION;
    assert_int_equal(pt_blocks_reopen(&b, 1.5), 4); /* 10 by 30, 20 by 100, 25 by 50, 50 by 100; 30 stays by 25 */
    assert_true(list[0].next_spp == 20 && list[1].next_spp == 67 && list[4].next_spp == 34 && list[5].next_spp == 67);
    assert_true(list[3].reason == PT_REASON_CRITERION);
}

/* --- a frame, a view ---------------------------------------------------------------------------------------------------- */

static void a_frame_is_described(void **state)
{
    (void)state;
    struct base_err err = {0};
    static const double xyz[9] = BASE_RGB_TO_XYZ;
    set_up(PT_FILM_ALL, LULL_PLANE_BIT(LULL_PLANE_SPP));
    for (int again = 0; again < 2; again++) {
        assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
        const struct lull_frame *f = &heard.frame;
        assert_int_equal(f->struct_size, sizeof *f);
        assert_int_equal(f->flags, again ? LULL_FRAME_RESTART | LULL_FRAME_INDEPENDENT : LULL_FRAME_DETERMINISTIC);
        assert_true(f->width == 20 && f->height == 14 && f->block_count == 6 && f->block_stride == sizeof(struct lull_rect));
        for (int i = 0; i < 6; i++) {
            const struct pt_block *b = &blocks.list[i];
            assert_true(heard.rects[i].x0 == b->x0 && heard.rects[i].y0 == b->y0 && heard.rects[i].x1 == b->x1 && heard.rects[i].y1 == b->y1);
        }
        assert_int_equal(f->planes, ALL_PLANES);
        assert_true(f->transfer == LULL_TRANSFER_SRGB && f->exposure == 1 && f->gamma == 0 && f->sample_clamp == 6 && f->time_budget_s == 2.5);
        assert_true(f->spp_min == 3 && f->spp_max == 90 && f->seed == 77);
        assert_memory_equal(f->rgb_to_xyz, xyz, sizeof xyz);
        frame.deterministic = 0;
        frame.independent = 1;
    }
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; begin 0; begin 0; end 0; destroy 0; ");
}

static void check_plane(int i, const void *data, int channels, int bytes, int type, int normaliser)
{
    const struct lull_plane *p = &heard.planes[i];
    assert_true(p->data == data && p->stride_x == channels * bytes && p->stride_y == 12 * channels * bytes && p->stride_c == bytes);
    assert_true(p->scale == 1 && p->type == type && p->normaliser == normaliser && p->channels == (uint32_t)channels && p->flags == 0);
}

static void a_view_is_described(void **state)
{
    (void)state;
    struct base_err err = {0};
    static const uint32_t due[3] = {1, 2, 4};
    static const uint8_t final[3] = {0, 1, 0};
    struct lull_decision got[3];
    set_up(PT_FILM_ALL, LULL_PLANE_BIT(LULL_PLANE_SPP));
    heard.answer[1] = (struct lull_decision){.action = LULL_STOP, .error = 1};
    heard.answer[2] = (struct lull_decision){.error = 2};
    heard.answer[4] = (struct lull_decision){.next_spp = 40, .error = 4, .p_noisy = 0.5, .predicted_spp = 60};
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
    assert_int_equal(pt_criterion_evaluate(criterion, &film, &blocks, due, 3, final, got, &err), 0);
    const struct lull_view *v = &heard.view;
    assert_true(v->struct_size == sizeof *v && v->flags == 0 && v->x0 == 8 && v->y0 == 0 && v->x1 == 20 && v->y1 == 14);
    assert_true(v->plane_count == LULL_PLANE_COUNT && v->plane_stride == sizeof(struct lull_plane));
    assert_true(v->all_count == 6 && v->all_stride == sizeof(struct lull_block) && v->elapsed_s >= 0 && v->elapsed_s < 60);
    check_plane(LULL_PLANE_COLOR, film.color, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_HALF, film.half, 3, 8, LULL_TYPE_F64, LULL_NORM_HALF_SPP);
    check_plane(LULL_PLANE_MOMENT2, film.moment2, 1, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_ALBEDO, film.albedo, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_NORMAL, film.normal, 3, 8, LULL_TYPE_F64, LULL_NORM_SPP);
    check_plane(LULL_PLANE_DEPTH, film.depth, 1, 8, LULL_TYPE_F64, LULL_NORM_ONE);
    check_plane(LULL_PLANE_SPP, criterion->spp, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    check_plane(LULL_PLANE_WEIGHT, criterion->spp, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    /* pixel (8, 6) is the 72nd of the film */
    assert_true(heard.corner[0] == 1000 + 217 && heard.corner[1] == 2000 + 218 && heard.corner[2] == 3000 + 72);
    assert_true(heard.corner[3] == 5000 + 218 && heard.corner[4] == 6000 + 72 && heard.pixel_spp == 12);
    for (uint32_t i = 0; i < 6; i++) {
        const struct lull_block *b = &heard.all[i];
        const struct pt_block *p = &blocks.list[i];
        assert_true(b->id == i && b->flags == (i == 2 ? LULL_BLOCK_STOPPED : 0) && b->spp == 10 + i && b->half_spp == pt_film_half_spp(10 + i));
        assert_true(b->x0 == p->x0 && b->y0 == p->y0 && b->x1 == p->x1 && b->y1 == p->y1 && b->thread_s == 0.5 + i);
    }
    assert_true(heard.count == 3 && heard.due[1].flags == (LULL_BLOCK_STOPPED | LULL_BLOCK_FINAL) && heard.due[2].flags == 0);
    assert_true(heard.preset.action == LULL_CONTINUE && heard.preset.next_spp == 0 && isnan(heard.preset.error) && isnan(heard.preset.p_noisy) &&
                isnan(heard.preset.predicted_spp));
    assert_true(got[0].action == LULL_STOP && got[1].error == 2 && got[2].next_spp == 40 && got[2].p_noisy == 0.5);
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; begin 0; ask 0 of 1 2! 4; end 0; destroy 0; ");
}

/* Counts of samples only for who requires them; samples that were dropped are made up for, and only as long as it looks. */
static void planes_as_wanted_and_dropped_samples(void **state)
{
    (void)state;
    struct base_err err = {0};
    static const uint32_t due[1] = {2};
    static const uint8_t final[1] = {0};
    struct lull_decision got[1];
    set_up(PT_FILM_HALF | PT_FILM_NORMAL | PT_FILM_DEPTH | PT_FILM_MOMENT2, LULL_PLANE_BIT(LULL_PLANE_WEIGHT));
    const size_t i = pt_film_index(&film, 8, 6); /* in block 2, which has 12 samples, 4 of half A */
    assert_int_equal(pt_film_half_spp(12), 4);
    film.dropped[i] = 4;
    film.dropped_half[i] = 2;
    blocks.list[2].dropped = 4;
    double before[3] = {film.color[3 * i + 1], film.half[3 * i + 2], film.moment2[i]};
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
    assert_int_equal(heard.frame.planes, ALL_PLANES & ~LULL_PLANE_BIT(LULL_PLANE_ALBEDO));
    assert_int_equal(pt_criterion_evaluate(criterion, &film, &blocks, due, 1, final, got, &err), 0);
    assert_true(!heard.planes[LULL_PLANE_ALBEDO].data && heard.planes[LULL_PLANE_ALBEDO].channels == 0 && heard.pixel_spp == 12);
    assert_true(fabs(heard.corner[0] / (before[0] * 12 / 8) - 1) < 1e-15 && fabs(heard.corner[1] / (before[1] * 4 / 2) - 1) < 1e-15);
    assert_true(fabs(heard.corner[2] / (before[2] * 12 / 8) - 1) < 1e-15);
    assert_true(film.color[3 * i + 1] == before[0] && film.half[3 * i + 2] == before[1] && film.moment2[i] == before[2]);
    tear_down();
    set_up(PT_FILM_ALL, LULL_PLANE_BIT(LULL_PLANE_COLOR));
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
    assert_int_equal(heard.frame.planes, ALL_PLANES & ~(LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT)));
    tear_down();
    static const struct {
        uint32_t abi, film;
    } map[] = {{LULL_PLANE_COLOR, 0}, {LULL_PLANE_WEIGHT, 0}, {LULL_PLANE_SPP, 0}, {LULL_PLANE_HALF, PT_FILM_HALF},
               {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2}, {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO}, {LULL_PLANE_NORMAL, PT_FILM_NORMAL},
               {LULL_PLANE_DEPTH, PT_FILM_DEPTH}};
    for (size_t k = 0; k < sizeof map / sizeof map[0]; k++) {
        struct lull_requirements needs = {.planes_used = LULL_PLANE_BIT(map[k].abi)};
        assert_int_equal(pt_host_film_planes(&needs), PT_FILM_COLOR | map[k].film);
    }
}

static void what_a_criterion_fails_with(void **state)
{
    (void)state;
    struct base_err err = {0};
    static const uint32_t due[2] = {1, 2};
    static const uint8_t final[2] = {0};
    struct lull_decision got[2];
    struct pt_criterion *none = NULL;
    set_up(PT_FILM_ALL, 0);
    heard.create = LULL_E_MEMORY;
    assert_int_equal(pt_criterion_create(&table, NULL, 0, NULL, NULL, NULL, &none, &err), BASE_ENOMEM);
    assert_string_equal(err.text, "criterion logger: the moon is full");
    heard.create = LULL_OK;
    heard.require = LULL_E_INVALID;
    assert_int_equal(pt_criterion_create(&table, NULL, 0, NULL, NULL, NULL, &none, &err), BASE_EINVAL);
    assert_null(none);
    heard.begin = LULL_E_UNSUPPORTED;
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger: the moon is full");
    heard.begin = LULL_OK;
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
    assert_false(heard.frame.flags & LULL_FRAME_RESTART); /* the first did not open */
    heard.answer[1] = heard.answer[2] = (struct lull_decision){.action = LULL_STOP, .error = 3};
    heard.evaluate = LULL_E_MEMORY;
    assert_int_equal(pt_criterion_evaluate(criterion, &film, &blocks, due, 2, final, got, &err), BASE_ENOMEM);
    for (int k = 0; k < 2; k++)
        assert_true(got[k].action == LULL_CONTINUE && got[k].next_spp == 0 && isnan(got[k].error));
    tear_down();
    /* blocks of one size only */
    set_up(PT_FILM_ALL, 0);
    static const struct {
        uint32_t flags, width, height;
        int rc;
    } sizes[] = {{0, 8, 6, 0}, {0, 8, 7, BASE_EINVAL}, {0, 7, 6, BASE_EINVAL}, {LULL_REQ_FLEXIBLE, 7, 7, 0}, {0, 0, 7, 0}, {0, 7, 0, 0}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        criterion->needs.flags = sizes[i].flags;
        criterion->needs.block_width = sizes[i].width;
        criterion->needs.block_height = sizes[i].height;
        assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), sizes[i].rc);
        if (i == 2)
            assert_string_equal(err.text, "criterion logger judges blocks of 7x6 pixels only: use --block 7x6");
    }
    tear_down();
}

/* --- masks -------------------------------------------------------------------------------------------------------------- */

static void dials(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct lull_pair dial, given[2] = {{"threshold", "2"}, {"visible", "0.4"}};
    char value[32];
    for (int s = 0; s <= PT_MASK_STEPS; s++)
        assert_true(fabs(pt_mask_scale(s) - pow(4, -s / 8.0)) < 1e-15);
    assert_int_equal(pt_mask_dial(&table, NULL, 0, 0, value, &dial, &err), 0); /* visible has no value */
    assert_true(strcmp(dial.key, "threshold") == 0 && dial.value == value && strtod(value, NULL) == 0.5);
    assert_int_equal(pt_mask_dial(&table, NULL, 0, 8, value, &dial, &err), 0); /* 0.125 is below its range */
    assert_true(strtod(value, NULL) == 0.25);
    assert_int_equal(pt_mask_dial(&table, given, 1, 4, value, &dial, &err), 0);
    assert_true(strtod(value, NULL) == 1.0);
    assert_int_equal(pt_mask_dial(&table, given, 2, 8, value, &dial, &err), 0);
    assert_true(strcmp(dial.key, "visible") == 0 && fabs(strtod(value, NULL) - 0.1) < 1e-16);
    struct lull_criterion less = table;
    less.param_count = 1;
    assert_int_equal(pt_mask_dial(&less, NULL, 0, 0, value, &dial, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger: --mask scales 'visible', which has no value: give it with -p visible=VALUE");
    less.param_count = 0;
    assert_int_equal(pt_mask_dial(&less, NULL, 0, 0, value, &dial, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger has no dial 'visible' or 'threshold' for --mask to scale");
    const struct lull_param *found;
    const struct lull_pair twice[2] = {{"threshold", "2"}, {"threshold", "3"}};
    assert_string_equal(pt_criterion_parameter(&table, "threshold", twice, 2, &found), "3");
    assert_ptr_equal(found, &parameters[1]);
    assert_null(pt_criterion_parameter(&table, "other", twice, 2, &found));
    assert_null(found);
    assert_null(pt_criterion_parameter(&table, "visible", twice, 2, NULL));
}

/* Grey is the mean of the colours as they are stored, alpha is none of them; what is no number, or beyond 0 to 1, is cut. */
static void masks_are_read(void **state)
{
    (void)state;
    struct base_err err = {0};
    char path[64], line[200];
    struct pt_mask mask;
    static const uint8_t pixels[24] = {0, 30, 255, 51, 102, 102, 255, 255, 255, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    snprintf(path, sizeof path, "/tmp/pt_host_%ld.png", (long)getpid());
    for (int channels = 1; channels <= 4; channels++) {
        assert_int_equal(base_png_write(path, 3, 2, channels, pixels, &err), 0);
        assert_int_equal(pt_mask_read(path, 3, 2, &mask, &err), 0);
        assert_true(mask.width == 3 && mask.height == 2);
        for (int i = 0; i < 6; i++) {
            const uint8_t *p = pixels + channels * i;
            double grey = channels < 3 ? p[0] / 255.0 : (p[0] + p[1] + p[2]) / 765.0;
            assert_true(fabs((double)mask.grey[i] - grey) < 1e-6);
        }
        pt_mask_release(&mask);
        assert_true(!mask.grey && mask.width == 0);
    }
    for (int k = 0; k < 2; k++) {
        assert_int_equal(pt_mask_read(path, 3 + k, 3 - k, &mask, &err), BASE_EINVAL);
        snprintf(line, sizeof line, "--mask %s: it has 3x2 pixels, the image %dx%d", path, 3 + k, 3 - k);
        assert_string_equal(err.text, line);
    }
    unlink(path);
    assert_int_equal(pt_mask_read(path, 3, 2, &mask, &err), BASE_EINVAL); /* an input: not BASE_EIO */
    snprintf(line, sizeof line, "%s: No such file or directory", path);
    assert_string_equal(err.text, line);
    snprintf(path, sizeof path, "/tmp/pt_host_%ld.pfm", (long)getpid());
    static const float values[4] = {-0.5f, 0.25f, 7.0f, NAN};
    FILE *f = fopen(path, "wb");
    assert_true(f && fputs("Pf\n4 1\n-1.0\n", f) >= 0 && fwrite(values, 4, 4, f) == 4 && fclose(f) == 0);
    assert_int_equal(pt_mask_read(path, 4, 1, &mask, &err), 0);
    assert_true(mask.grey[0] == 0 && mask.grey[1] == 0.25f && mask.grey[2] == 1 && mask.grey[3] == 0);
    pt_mask_release(&mask);
    unlink(path);
}

/* Blocks of a mask are judged by instances of their own dial, each asked once. */
static void every_step_has_its_instance(void **state)
{
    (void)state;
    struct base_err err = {0};
    float grey[20 * 14] = {0};
    const struct pt_mask mask = {20, 14, grey};
    const struct lull_pair pair = {"threshold", "2"};
    static const uint32_t due[5] = {0, 1, 2, 4, 5};
    static const uint8_t final[5] = {0, 0, 0, 1, 0};
    struct lull_decision got[5];
    unsigned char *bytes;
    size_t size;
    set_up(PT_FILM_ALL, 0);
    grey[20 * 11 + 15] = 0.5f;   /* the last pixel of block 2 */
    grey[20 * 6 + 16] = 0.43f;   /* the first of block 3: 3.44 steps */
    grey[20 * 13 + 19] = 0.44f;  /* the last of block 5: 3.52 */
    grey[0] = 1;                 /* in no block */
    for (int i = 0; i < 6; i++)
        heard.answer[i] = (struct lull_decision){.error = i};
    assert_int_equal(pt_criterion_set_mask(criterion, &mask, &pair, 1, &err), 0);
    assert_int_equal(pt_criterion_begin(criterion, &frame, &blocks, &film, &err), 0);
    static const uint8_t steps[6] = {0, 0, 4, 3, 0, 4};
    assert_memory_equal(criterion->step, steps, 6);
    assert_int_equal(pt_criterion_evaluate(criterion, &film, &blocks, due, 5, final, got, &err), 0);
    for (int k = 0; k < 5; k++)
        assert_true(got[k].error == due[k]);
    assert_int_equal(pt_criterion_save(criterion, &bytes, &size, &err), 0);
    static const unsigned char expected[9] = {1, 2, 0, 1, 2, 19, 1, 2, 16}; /* dials 0, 2 · 4^(-3/8), 1 */
    assert_int_equal(size, 9);
    assert_memory_equal(bytes, expected, 9);
    assert_int_equal(pt_criterion_load(criterion, bytes, size, &err), 0);
    free(bytes);
    tear_down();
    assert_string_equal(heard.calls, "create 0 of 0; create 1 of 2; create 1.18921 of 2; begin 0; begin 1.18921; begin 1; "
                                     "ask 0 of 0 1 4!; ask 1 of 2 5; end 0; destroy 0; end 1.18921; destroy 1.18921; end 1; destroy 1; ");
}

/* --- its memory, what it is offered ------------------------------------------------------------------------------------- */

static void histories(void **state)
{
    (void)state;
    struct base_err err = {0};
    unsigned char *bytes = NULL;
    size_t size = 9;
    static const unsigned char kept[4] = {7, 8, 9, 10};
    set_up(PT_FILM_ALL, 0);
    assert_int_equal(pt_criterion_load(criterion, kept, 3, &err), 0);
    assert_memory_equal(heard.state, kept, 3);
    assert_int_equal(pt_criterion_load(criterion, kept, 4, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger: 1 bytes of its state were left over");
    assert_int_equal(pt_criterion_load(criterion, kept, 2, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger: cannot load its state: cut");
    heard.load = heard.save = LULL_E_MEMORY;
    assert_int_equal(pt_criterion_load(criterion, kept, 3, &err), BASE_ENOMEM);
    assert_string_equal(err.text, "criterion logger: cannot load its state: the moon is full");
    assert_int_equal(pt_criterion_save(criterion, &bytes, &size, &err), BASE_ENOMEM);
    assert_string_equal(err.text, "criterion logger: cannot save its state: the moon is full");
    struct lull_criterion forgetful = table;
    forgetful.get_extension = NULL;
    criterion->table = &forgetful;
    assert_int_equal(pt_criterion_save(criterion, &bytes, &size, &err), 0);
    assert_true(!bytes && size == 0);
    assert_int_equal(pt_criterion_load(criterion, kept, 0, &err), 0);
    assert_int_equal(pt_criterion_load(criterion, kept, 1, &err), BASE_EINVAL);
    assert_string_equal(err.text, "criterion logger keeps no state, but the checkpoint has one");
    criterion->table = &table;
    tear_down();
}

static void count_task(void *arg, uint64_t task, uint32_t worker)
{
    assert_true(worker < 3);
    ((int *)arg)[task]++;
}

static void services(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct base_threads *threads = base_threads_create(3, &err);
    struct pt_criterion *busy = NULL;
    set_up(PT_FILM_ALL, 0);
    assert_int_equal(pt_criterion_create(&table, NULL, 0, threads, NULL, NULL, &busy, &err), 0);
    const struct lull_host *alone = criterion->dialled[0]->host, *many = busy->dialled[0]->host;
    assert_true(alone->struct_size == sizeof *alone && alone->api_minor == LULL_API_MINOR && alone->max_workers == 1 && many->max_workers == 3);
    assert_true(alone->flags == 0 && !alone->cancelled && !alone->get_extension);
    assert_string_equal(alone->name, "lull pathtracer " BASE_VERSION);
    alone->log(alone, LULL_LOG_INFO, "psst");
    assert_string_equal(warned, "");
    alone->log(alone, LULL_LOG_WARNING, "mind the gap");
    assert_string_equal(warned, "criterion logger: mind the gap");
    alone->log(alone, LULL_LOG_ERROR, "gone");
    assert_string_equal(warned, "criterion logger: gone");
    many->log(many, LULL_LOG_ERROR, "nobody hears it");
    for (int k = 0; k < 2; k++) {
        int done[20] = {0};
        const struct lull_host *host = k ? many : alone;
        assert_int_equal(host->parallel_for(host, 19, count_task, done), LULL_OK);
        for (int i = 0; i < 20; i++)
            assert_int_equal(done[i], i < 19);
    }
    pt_criterion_destroy(busy);
    base_threads_destroy(threads);
    tear_down();
}

/* --- criteria by name ---------------------------------------------------------------------------------------------------- */

static char lines[1000];

static void keep_line(void *data, const char *line)
{
    assert_ptr_equal(data, lines);
    if (strncmp(line, "skipped: ", 9) == 0) /* the build's own may have something to say too */
        snprintf(lines + strlen(lines), sizeof lines - strlen(lines), "%s\n", line);
}

/* What is printed of the first two criteria: the build's own follow, if it has some. */
static void print_first_two(FILE *out, const char *text, int count)
{
    int seen = 0, from = 0;
    for (size_t n; *text != '\0'; text += n) {
        n = strcspn(text, "\n") + 1;
        seen += *text != ' ';
        from += strncmp(text, "    from ", 9) == 0;
        if (seen <= 2)
            fprintf(out, "%.*s", (int)n, text);
    }
    assert_true(from == count && seen == count);
}

/* A folder with two criteria and something that is none; its name is CRITERIA in what is said. */
static char *listed(struct pt_approve_case *c)
{
    char folder[] = "/tmp/pt_host_XXXXXX", built[2048], from[2200], path[3][64], *text = NULL, *at;
    static const char *const names[3] = {"fixed.so", "halfbuf.so", "none.so"};
    size_t size;
    struct base_err err = {0};
    struct base_inputs inputs = BASE_INPUTS_EMPTY;
    const struct lull_criterion *found = NULL;
    (void)c;
    assert_true(mkdtemp(folder) && api_folder(built, sizeof built, API_CRITERIA) == 0 && setenv("LULL_PLUGIN_PATH", folder, 1) == 0);
    for (int i = 0; i < 3; i++) {
        snprintf(from, sizeof from, "%s/%s", i < 2 ? built : "/dev/null", i < 2 ? names[i] : "");
        snprintf(path[i], sizeof path[i], "%s/%s", folder, names[i]);
        if (i < 2)
            assert_int_equal(symlink(from, path[i]), 0);
    }
    FILE *out = fopen(path[2], "w");
    assert_true(out && fclose(out) == 0);
    lines[0] = '\0';
    assert_non_null(out = open_memstream(&text, &size));
    int count = pt_criterion_list(out, keep_line, lines);
    fclose(out);
    char *all = text;
    assert_non_null(out = open_memstream(&text, &size));
    print_first_two(out, all, count);
    free(all);
    assert_int_equal(pt_criterion_find("halfbuf", &inputs, keep_line, lines, &found, &err), 0);
    fprintf(out, "found %s; an input is %s\n", found->id, inputs.paths[0]);
    int rc = pt_criterion_find("nobody", &inputs, keep_line, lines, &found, &err);
    fprintf(out, "%d: %s; %zu input\n%s", rc, err.text, inputs.count, lines);
    assert_int_equal(pt_criterion_find("fixed", NULL, NULL, NULL, &found, &err), 0);
    assert_string_equal(found->id, "fixed");
    fclose(out);
    base_inputs_release(&inputs);
    while ((at = strstr(text, folder)) != NULL) {
        memcpy(at, "CRITERIA", 8);
        memmove(at + 8, at + strlen(folder), strlen(at + strlen(folder)) + 1);
    }
    for (int i = 0; i < 3; i++)
        unlink(path[i]);
    rmdir(folder);
    unsetenv("LULL_PLUGIN_PATH");
    return text;
}

static void criteria_by_name(void **state)
{
    (void)state;
    pt_approve("tests/golden/pathtracer/criteria.txt", listed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(grids),
        cmocka_unit_test(next_checks_and_seams),
        cmocka_unit_test(a_frame_is_described),
        cmocka_unit_test(a_view_is_described),
        cmocka_unit_test(planes_as_wanted_and_dropped_samples),
        cmocka_unit_test(what_a_criterion_fails_with),
        cmocka_unit_test(dials),
        cmocka_unit_test(masks_are_read),
        cmocka_unit_test(every_step_has_its_instance),
        cmocka_unit_test(histories),
        cmocka_unit_test(services),
        cmocka_unit_test(criteria_by_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
