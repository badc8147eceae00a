#include "support/api_host_film.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdio.h>
#include <string.h>

#include <cmocka.h>

double sums[LULL_PLANE_COUNT][3 * PIXELS];
uint32_t lost[PIXELS], lost_half[PIXELS];
struct lull_plane planes[LULL_PLANE_COUNT], lost_plane;
struct lull_host_view view;
struct lull_host_criterion *criterion;
struct lull_host_frame *frame;
struct lull_host_config config;
struct lull_error err;
char warned[700];
int released;
static struct lull_plane lost_half_plane;

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

const struct lull_host_services services = {
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

void set_up(uint32_t supplied, uint32_t required)
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

struct lull_host_block *begin(void)
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

void tear_down(void)
{
    lull_host_end(frame);
    frame = NULL;
    released = 0;
    lull_host_close(criterion);
    assert_int_equal(released, 1);
}
