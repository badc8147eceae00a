/* What the host library tells a criterion, field by field, what becomes of the answers, and what it keeps of both. */
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

#include "base/colour.h"
#include "host/frame.h"

/* --- a criterion that writes everything down ---------------------------------------------------------------------------- */

enum { MOST = 16, ALL_PLANES = LULL_PLANE_BIT(LULL_PLANE_COUNT) - 1 };

struct lull_instance {
    double quality;
    const struct lull_host *host;
};

static struct {
    struct lull_requirements needs;
    struct lull_decision answer[MOST];                    /* by block */
    int32_t create, require, begin, evaluate, save, load; /* to be answered */
    double fails_at;                                      /* the quality of an instance that fails to evaluate */
    char calls[400];
    struct lull_frame frame;
    struct lull_rect rects[MOST];
    struct lull_view view;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block all[MOST], due[MOST];
    uint32_t count;
    double corner[5], pixel_spp; /* of pixel (8, 6) as the planes have it; -1: no such plane */
    double weight[2];            /* of that pixel and the next, -1 likewise */
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

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                      struct lull_instance **out, struct lull_error *err)
{
    if (heard.create != LULL_OK)
        return said(heard.create, err);
    struct lull_instance *in = calloc(1, sizeof *in);
    assert_true(in && stride == sizeof *pairs);
    in->host = host;
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(pairs[i].key, "threshold") == 0)
            in->quality = strtod(pairs[i].value, NULL);
    note("create %g of %u; ", in->quality, count);
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

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *opened, struct lull_error *err)
{
    heard.frame = *opened;
    memcpy(heard.rects, opened->blocks, opened->block_count * sizeof *opened->blocks);
    note("begin %g; ", in->quality);
    return said(heard.begin, err);
}

static double at(const struct lull_view *seen, int plane, int x, int y, int channel)
{
    const struct lull_plane *p = &seen->planes[plane];
    const char *data = p->data;
    data += (x - seen->x0) * p->stride_x + (y - seen->y0) * p->stride_y + channel * p->stride_c;
    return p->type == LULL_TYPE_U32 ? (double)*(const uint32_t *)(const void *)data : *(const double *)(const void *)data;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
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
    for (int i = 0; i < 2; i++)
        heard.weight[i] = view->planes[LULL_PLANE_WEIGHT].data ? at(view, LULL_PLANE_WEIGHT, 8 + i, 6, 0) : -1;
    note("ask %g of", in->quality);
    for (uint32_t k = 0; k < count; k++) {
        note(" %u%s", blocks[k].id, blocks[k].flags & LULL_BLOCK_FINAL ? "!" : "");
        decisions[k] = heard.answer[blocks[k].id];
    }
    note("; ");
    return said(in->quality == heard.fails_at && in->quality > 0 ? LULL_E_INTERNAL : heard.evaluate, err);
}

static void end_frame(struct lull_instance *in) { note("end %g; ", in->quality); }

static void destroy(struct lull_instance *in)
{
    note("destroy %g; ", in->quality);
    free(in);
}

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    unsigned char bytes[3] = {1, 2, (unsigned char)(16 * in->quality)};
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
static struct lull_criterion table = {.struct_size = sizeof table,
                                      .id = "logger",
                                      .name = "l",
                                      .version = "3",
                                      .description = "d",
                                      .params = parameters,
                                      .param_count = 2,
                                      .param_stride = sizeof parameters[0],
                                      .create = create,
                                      .requirements = requirements,
                                      .begin_frame = begin_frame,
                                      .evaluate = evaluate,
                                      .end_frame = end_frame,
                                      .destroy = destroy,
                                      .get_extension = get_extension};

/* --- a film with blocks ------------------------------------------------------------------------------------------------- */

enum { WIDTH = 12, HEIGHT = 14, PIXELS = WIDTH * HEIGHT }; /* of the film, whose first pixel is (8, 0) */

static double sums[LULL_PLANE_COUNT][3 * PIXELS];
static uint32_t lost[PIXELS], lost_half[PIXELS];
static struct lull_plane planes[LULL_PLANE_COUNT], lost_plane, lost_half_plane;
static struct lull_host_view view;
static struct lull_host_criterion *criterion;
static struct lull_host_frame *frame;
static struct lull_host_config config;
static struct lull_error err;
static char warned[700];
static int released;

static void keep(void *context, int32_t level, const char *line)
{
    assert_ptr_equal(context, &config);
    snprintf(warned, sizeof warned, "%d: %s", level, line);
}

static void release(void *context)
{
    assert_ptr_equal(context, &config);
    released++;
}

static const struct lull_host_services services = {
    .struct_size = sizeof services, .name = "a test", .context = &config, .log = keep, .release = release};

static struct lull_plane plane_at(const void *data, uint32_t channels, size_t size, int32_t type, int32_t normaliser)
{
    const int64_t pixel = (int64_t)(channels * size);
    return (struct lull_plane){.data = data,
                               .stride_x = pixel,
                               .stride_y = WIDTH * pixel,
                               .stride_c = (int64_t)size,
                               .scale = 1,
                               .type = type,
                               .normaliser = normaliser,
                               .channels = channels};
}

/* 20 x 14 pixels in blocks of 8 x 6, of which a crop touches the last two columns; every sum of its own. The planes are those of a
 * mask; without counts. */
static void set_up(uint32_t supplied, uint32_t required)
{
    static const struct {
        uint32_t channels;
        int32_t normaliser;
    } form[LULL_PLANE_COUNT] = {{3, LULL_NORM_SPP},
                                {0, 0},
                                {0, 0},
                                {1, LULL_NORM_SPP},
                                {3, LULL_NORM_HALF_SPP},
                                {3, LULL_NORM_SPP},
                                {3, LULL_NORM_SPP},
                                {1, LULL_NORM_ONE}};
    memset(&heard, 0, sizeof heard);
    memset(lost, 0, sizeof lost);
    memset(lost_half, 0, sizeof lost_half);
    memset(planes, 0, sizeof planes);
    err = (struct lull_error){.struct_size = sizeof err};
    heard.needs = (struct lull_requirements){.struct_size = sizeof heard.needs,
                                             .flags = LULL_REQ_FLEXIBLE,
                                             .planes_required = required,
                                             .planes_used = ALL_PLANES};
    config = (struct lull_host_config){.struct_size = sizeof config,
                                       .flags = LULL_FRAME_DETERMINISTIC,
                                       .width = 20,
                                       .height = 14,
                                       .block_width = 8,
                                       .block_height = 6,
                                       .crop = {9, 1, 20, 13},
                                       .planes = supplied,
                                       .spp_min = 3,
                                       .spp_max = 90,
                                       .seed = 77,
                                       .time_budget_s = 2.5,
                                       .sample_clamp = 6,
                                       .transfer = LULL_TRANSFER_SRGB};
    for (int k = 0; k < LULL_PLANE_COUNT; k++) {
        for (int i = 0; i < 3 * PIXELS; i++)
            sums[k][i] = 1000.0 * (k + 1) + i;
        if (supplied >> k & 1 && form[k].channels > 0)
            planes[k] = plane_at(sums[k], form[k].channels, 8, LULL_TYPE_F64, form[k].normaliser);
    }
    lost_plane = plane_at(lost, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    lost_half_plane = plane_at(lost_half, 1, 4, LULL_TYPE_U32, LULL_NORM_ONE);
    view = (struct lull_host_view){.struct_size = sizeof view,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .x0 = 8,
                                   .x1 = 20,
                                   .y1 = 14,
                                   .planes = planes,
                                   .dropped = &lost_plane,
                                   .dropped_half = &lost_half_plane};
    assert_int_equal(lull_host_create(&services, &table, NULL, 0, &criterion, &err), LULL_OK);
}

static struct lull_host_block *begin(void)
{
    frame = NULL;
    if (lull_host_begin(&config, criterion, &frame, &err) != LULL_OK)
        return NULL;
    struct lull_host_block *list = lull_host_blocks_of(frame)->list;
    for (uint32_t i = 0; i < lull_host_blocks_of(frame)->count; i++) {
        list[i].spp = 10 + i;
        list[i].half_spp = 4 + i / 2;
        list[i].thread_s = 0.5 + i;
    }
    return list;
}

static void tear_down(void)
{
    lull_host_end(frame);
    frame = NULL;
    released = 0;
    lull_host_close(criterion);
    assert_int_equal(released, 1);
}

/* --- blocks -------------------------------------------------------------------------------------------------------------- */

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

/* --- masks -------------------------------------------------------------------------------------------------------------- */

static void qualities(void **state)
{
    (void)state;
    struct lull_pair quality, given[2] = {{"threshold", "2"}, {"visible", "0.4"}};
    char value[32];
    err = (struct lull_error){.struct_size = sizeof err};
    for (uint32_t s = 0; s <= LULL_HOST_STEPS; s++)
        assert_true(fabs(lull_host_mask_factor(s) - pow(4, -(double)s / 8.0)) < 1e-15);
    assert_int_equal(lull_host_scale_quality(&table, NULL, 0, 0, value, &quality, &err), LULL_OK); /* visible has no value */
    assert_true(strcmp(quality.key, "threshold") == 0 && quality.value == value && strtod(value, NULL) == 0.5);
    assert_int_equal(lull_host_scale_quality(&table, NULL, 0, 8, value, &quality, &err),
                     LULL_OK); /* 0.125 is below its range */
    assert_true(strtod(value, NULL) == 0.25);
    assert_int_equal(lull_host_scale_quality(&table, given, 1, 4, value, &quality, &err), LULL_OK);
    assert_true(strtod(value, NULL) == 1.0);
    assert_int_equal(lull_host_scale_quality(&table, given, 2, 8, value, &quality, &err), LULL_OK);
    assert_true(strcmp(quality.key, "visible") == 0 && fabs(strtod(value, NULL) - 0.1) < 1e-16);
    struct lull_criterion less = table;
    less.param_count = 1;
    assert_int_equal(lull_host_scale_quality(&less, NULL, 0, 0, value, &quality, &err), LULL_E_VALUE);
    assert_string_equal(err.message,
                        "criterion logger: a mask scales 'visible', which has no value: give one, visible=VALUE");
    less.param_count = 0;
    assert_int_equal(lull_host_scale_quality(&less, NULL, 0, 0, value, &quality, &err), LULL_E_KEY);
    assert_string_equal(err.message,
                        "criterion logger has no quality parameter 'visible' or 'threshold' for a mask to scale");
    const struct lull_param *found;
    const struct lull_pair twice[2] = {{"threshold", "2"}, {"threshold", "3"}};
    assert_string_equal(lull_host_parameter(&table, "threshold", twice, 2, &found), "3");
    assert_ptr_equal(found, &parameters[1]);
    assert_null(lull_host_parameter(&table, "other", twice, 2, &found));
    assert_null(found);
    assert_null(lull_host_parameter(&table, "visible", twice, 2, NULL));
}

static int32_t gather(const struct lull_writer *writer, const void *data, uint64_t size)
{
    char **end = writer->context;
    memcpy(*end, data, (size_t)size);
    *end += size;
    return LULL_OK;
}

/* Blocks of a mask are judged by instances of their own quality, each asked once; the mask may be of either type, from the bottom up. */
static void every_step_has_its_instance(void **state)
{
    (void)state;
    static const uint32_t due[5] = {0, 1, 2, 4, 5};
    static const uint8_t final[5] = {0, 0, 0, 1, 0};
    struct lull_decision got[5];
    for (int type = 0; type < 2; type++) {
        float f32[20 * 14] = {0};
        double f64[20 * 14] = {0};
        const struct {
            int x, y;
            double grey;
        } points[] = {{15, 11, 0.5},        /* the last pixel of block 2 */
                      {16, 6, 0.43},        /* the first of block 3: 3.44 steps */
                      {19, 13, 0.44},       /* the last of block 5: 3.52 */
                      {0, 0, 1},            /* in no block */
                      {9, 13, (double)NAN}, /* black, as what is below 0 */
                      {9, 12, -3}};
        for (size_t k = 0; k < sizeof points / sizeof points[0]; k++) {
            f32[20 * (13 - points[k].y) + points[k].x] = (float)points[k].grey;
            f64[20 * points[k].y + points[k].x] = points[k].grey;
        }
        const struct lull_plane masks[2] = {
            {.data = f32 + 20 * 13,
             .stride_x = 4,
             .stride_y = -80,
             .stride_c = 4,
             .scale = 1,
             .type = LULL_TYPE_F32,
             .channels = 1},
            {.data = f64, .stride_x = 8, .stride_y = 160, .stride_c = 8, .scale = 1, .type = LULL_TYPE_F64, .channels = 1}};
        const struct lull_pair pair = {"threshold", "2"};
        set_up(ALL_PLANES, 0);
        lull_host_close(criterion);
        heard.calls[0] = '\0';
        assert_int_equal(lull_host_create(&services, &table, &pair, 1, &criterion, &err), LULL_OK);
        for (int i = 0; i < 6; i++)
            heard.answer[i] = (struct lull_decision){.error = i};
        config.mask = &masks[type];
        struct lull_host_block *list = begin();
        static const uint32_t steps[6] = {0, 0, 4, 3, 0, 4};
        for (int i = 0; i < 6; i++)
            assert_int_equal(list[i].step, steps[i]);
        assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, final, 5, got, &err), LULL_OK);
        for (int k = 0; k < 5; k++)
            assert_true(got[k].error == due[k]);
        heard.fails_at = 1; /* the second of those asked: the first one's answers do not count either */
        heard.calls[strlen(heard.calls) - 1] = '\0';
        char kept[sizeof heard.calls];
        strcpy(kept, heard.calls);
        heard.answer[0].action = LULL_STOP;
        assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, final, 5, got, &err), LULL_E_INTERNAL);
        for (int k = 0; k < 5; k++)
            assert_true(got[k].action == LULL_CONTINUE && isnan(got[k].error));
        strcpy(heard.calls, kept);
        note(" ");
        char bytes[20], *end = bytes;
        struct lull_writer writer = {.struct_size = sizeof writer, .context = &end, .write = gather};
        assert_int_equal(lull_host_save_history(criterion, &writer, &err), LULL_OK);
        static const unsigned char expected[9] = {1, 2, 32, 1, 2, 19, 1, 2, 16}; /* qualities 2, 2 · 4^(-3/8), 1 */
        assert_int_equal(end - bytes, 9);
        assert_memory_equal(bytes, expected, 9);
        assert_int_equal(lull_host_load_history(criterion, bytes, 9, &err), LULL_OK);
        tear_down();
        assert_string_equal(
            heard.calls,
            "create 2 of 1; create 1 of 2; create 1.18921 of 2; begin 2; begin 1.18921; begin 1; "
            "ask 2 of 0 1 4!; ask 1 of 2 5; end 2; destroy 2; end 1.18921; destroy 1.18921; end 1; destroy 1; ");
    }
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
    const struct lull_host *alone = criterion->dialled[0]->host, *many = busy->dialled[0]->host,
                           *none = silent->dialled[0]->host;
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

/* --- files ----------------------------------------------------------------------------------------------------------- */

static void outputs_are_looked_at_first(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-host-XXXXXX", in[64], out[64], again[64];
    assert_non_null(mkdtemp(folder));
    snprintf(in, sizeof in, "%s/in.blend", folder);
    snprintf(out, sizeof out, "%s/out.png", folder);
    snprintf(again, sizeof again, "%s/./out.png", folder);
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_output list[2] = {{"output", out}, {"preview", again}};
    const char *inputs[] = {in};

    const uint8_t rgb[6] = {1, 2, 3, 4, 5, 6};
    assert_int_equal(lull_host_write_png(in, 2, 1, rgb, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 0, NULL, 0, &e), LULL_OK);
    assert_int_equal(lull_host_check_outputs(list, 2, inputs, 1, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "--preview "));
    list[0].path = in;
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_E_INVALID);
    assert_non_null(strstr(e.message, "this is an input"));
    list[0].path = "/nowhere/at/all";
    assert_int_equal(lull_host_check_outputs(list, 1, inputs, 1, &e), LULL_E_IO);
    assert_int_equal(lull_host_write_png(list[0].path, 2, 1, rgb, &e), LULL_E_IO);
    assert_int_equal(lull_host_write_png(out, 1u << 31, 1, rgb, &e), LULL_E_INVALID);
    unlink(in);
    assert_int_equal(rmdir(folder), 0);
}

/* What was there before stays until the file is complete. */
static void files_appear_when_they_are_whole(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-host-XXXXXX", path[64], text[8] = "";
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a", folder);
    struct lull_host_file *file;
    int32_t fd;
    for (int i = 0; i < 3; i++) { /* the second one is given up */
        assert_int_equal(lull_host_file_begin(path, &file, &fd, NULL), LULL_OK);
        assert_int_equal(write(fd, i == 0 ? "old" : "new", 3), 3);
        assert_int_equal(access(path, F_OK), i == 0 ? -1 : 0);
        if (i == 1)
            lull_host_file_abort(file);
        else
            assert_int_equal(lull_host_file_commit(file, NULL), LULL_OK);
        FILE *f = fopen(path, "r");
        assert_true(f && fread(text, 1, 4, f) == 3 && fclose(f) == 0);
        assert_string_equal(text, i < 2 ? "old" : "new");
    }
    unlink(path);
    assert_int_equal(rmdir(folder), 0); /* and nothing else is left */
    assert_int_equal(lull_host_file_begin(path, &file, &fd, NULL), LULL_E_IO);
}

static void codes_of_light(void **state)
{
    (void)state;
    const double light[] = {(double)NAN, -1, 0, 0.18, 0.5, 1, (double)INFINITY};
    const uint8_t wanted[] = {0, 0, 0, 118, 188, 255, 255};
    uint8_t codes[8] = {[7] = 9};
    lull_host_srgb(light, 7, codes);
    assert_memory_equal(codes, wanted, 7);
    assert_int_equal(codes[7], 9);
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
        cmocka_unit_test(a_frame_is_described),
        cmocka_unit_test(a_view_is_described),
        cmocka_unit_test(dropped_samples),
        cmocka_unit_test(what_a_criterion_fails_with),
        cmocka_unit_test(qualities),
        cmocka_unit_test(every_step_has_its_instance),
        cmocka_unit_test(histories),
        cmocka_unit_test(offers),
        cmocka_unit_test(outputs_are_looked_at_first),
        cmocka_unit_test(files_appear_when_they_are_whole),
        cmocka_unit_test(codes_of_light),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
