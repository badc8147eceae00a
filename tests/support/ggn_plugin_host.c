#include "support/ggn_plugin_host.h"

#include "support/ggn_cmocka.h"

#include <math.h>

#include "nn/hash.h"

const struct lull_rect gp_host_rects[GP_HOST_BLOCKS] = {{1, 2, 22, 20}, {30, 0, 60, 24}, {5, 25, 22, 44}};

float gp_host_color[GP_HOST_HEIGHT][GP_HOST_WIDTH][3], gp_host_half[GP_HOST_HEIGHT][GP_HOST_WIDTH][3];

/* What `spp` samples give; a little less than half of them are in HALF. Noise differs from block to block. */
void gp_host_render(uint64_t spp)
{
    for (uint32_t i = 0; i < GP_HOST_HEIGHT * GP_HOST_WIDTH; i++)
        for (uint32_t c = 0; c < 3; c++) {
            const double clean = 0.2 + 0.15 * sin(0.2 * (i % GP_HOST_WIDTH)) + 0.1 * c,
                         sigma = i % GP_HOST_WIDTH > 28 ? 0.7 : 0.1;
            const double n = (double)spp, h = (double)(spp * 3 / 8), a = ggn_hash_unit(3 * i + c, (uint32_t)spp) - 0.5,
                         b = ggn_hash_unit(3 * i + c, (uint32_t)spp + 9999) - 0.5;
            const double first = clean + sigma * a / sqrt(h), second = clean + sigma * b / sqrt(n - h);
            gp_host_half[i / GP_HOST_WIDTH][i % GP_HOST_WIDTH][c] = (float)first;
            gp_host_color[i / GP_HOST_WIDTH][i % GP_HOST_WIDTH][c] = (float)((h * first + (n - h) * second) / n);
        }
}

double gp_host_luminance(const float rgb[3]) { return 0.2 * (double)rgb[0] + 0.7 * (double)rgb[1] + 0.1 * (double)rgb[2]; }

struct lull_frame gp_host_frame(uint32_t planes, const struct ggn_display *display, uint64_t spp_max)
{
    static const int32_t transfers[] = {LULL_TRANSFER_SRGB, LULL_TRANSFER_LINEAR, LULL_TRANSFER_GAMMA};

    return (struct lull_frame){.struct_size = sizeof(struct lull_frame),
                               .width = GP_HOST_WIDTH,
                               .height = GP_HOST_HEIGHT,
                               .blocks = gp_host_rects,
                               .block_count = GP_HOST_BLOCKS,
                               .block_stride = sizeof gp_host_rects[0],
                               .planes = planes,
                               .exposure = display->exposure,
                               .transfer = transfers[display->transfer == GGN_TRANSFER_LINEAR  ? 1
                                                     : display->transfer == GGN_TRANSFER_GAMMA ? 2
                                                                                               : 0],
                               .gamma = display->gamma,
                               .spp_max = spp_max,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
}

const struct ggn_display gp_host_usual = {GGN_TRANSFER_SRGB, 2.2, 1};

/* Last task first, each on another worker: with as many as the host has, where it has several. */
static int32_t last_first(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    for (uint64_t task = count; task-- > 0;)
        fn(arg, task, (uint32_t)(task * 7 % host->max_workers));
    return LULL_OK;
}

struct lull_instance *gp_host_create(const struct lull_criterion *c, const char *path, const char *key, const char *value)
{
    static const struct lull_host hosts[] = {{.struct_size = sizeof hosts[0], .max_workers = 1},
                                             {.struct_size = sizeof hosts[0], .max_workers = 3, .parallel_for = last_first}};
    static int next;
    const struct lull_pair pairs[] = {{path ? "model" : key, path ? path : value}, {key, value}};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;

    if (c->create(&hosts[next++ % 2], pairs, (uint32_t)((path != NULL) + (key != NULL)), sizeof pairs[0], &in, &err) !=
        LULL_OK)
        fail_msg("%s", err.message);
    return in;
}

int32_t gp_host_evaluate(const struct lull_criterion *c, struct lull_instance *in, uint64_t spp, uint32_t ids,
                         struct lull_decision *d)
{
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {gp_host_color, 12, 12 * GP_HOST_WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0},
        [LULL_PLANE_HALF] = {gp_host_half, 12, 12 * GP_HOST_WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0}};
    const struct lull_view view = {.struct_size = sizeof view,
                                   .x1 = GP_HOST_WIDTH,
                                   .y1 = GP_HOST_HEIGHT,
                                   .planes = planes,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .plane_stride = sizeof planes[0],
                                   .elapsed_s = (double)NAN};
    struct lull_block blocks[GP_HOST_BLOCKS];
    struct lull_error err = {.struct_size = sizeof err};
    uint32_t n = 0;

    for (uint32_t id = 0; id < GP_HOST_BLOCKS; id++)
        if (ids >> id & 1)
            blocks[n++] = (struct lull_block){.id = id,
                                              .x0 = gp_host_rects[id].x0,
                                              .y0 = gp_host_rects[id].y0,
                                              .x1 = gp_host_rects[id].x1,
                                              .y1 = gp_host_rects[id].y1,
                                              .spp = spp,
                                              .half_spp = spp * 3 / 8,
                                              .thread_s = (double)NAN};
    for (uint32_t i = 0; i < n; i++)
        d[i] = (struct lull_decision){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    if (n && spp == UINT64_MAX)
        blocks[n - 1].x1--;
    return c->evaluate(in, &view, blocks, sizeof blocks[0], d, sizeof d[0], n, &err);
}
