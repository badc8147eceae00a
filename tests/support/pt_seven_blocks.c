#include "pt_seven_blocks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>

#include <cmocka.h>

#include "pt_fake.h"
#include "pt_text_scene.h"

static struct lull_host_frame *seven_blocks(struct lull_host_criterion *criterion)
{
    struct lull_rect layout[7];
    for (int i = 0; i < 7; i++)
        layout[i] = (struct lull_rect){i % 3 * 8, i / 3 * 4, i % 3 * 8 + 8, i < 6 ? i / 3 * 4 + 4 : 9};
    const struct lull_host_config laid = {.struct_size = sizeof laid,
                                          .width = 24,
                                          .height = 9,
                                          .layout = layout,
                                          .layout_count = 7,
                                          .layout_stride = sizeof layout[0],
                                          .spp_min = 1,
                                          .spp_max = 1000};
    struct lull_host_frame *frame;
    assert_int_equal(lull_host_begin(&laid, criterion, &frame, NULL), LULL_OK);
    return frame;
}

void pt_seven_blocks_init(struct pt_seven_blocks *s)
{
    *s = (struct pt_seven_blocks){.table = *pt_fake_criterion()};
    s->table.id = "law";
    assert_int_equal(lull_host_create(NULL, &s->table, NULL, 0, &s->criterion, NULL), LULL_OK);
    struct lull_host_frame *frame = seven_blocks(s->criterion);
    s->list = lull_host_blocks_of(frame)->list;
    for (int i = 0; i < 7; i++) {
        s->list[i].id = 10u + (uint32_t)i;
        s->list[i].spp = i == 3 ? 0 : 16u + (uint32_t)i;
        s->list[i].thread_s = i == 3 ? 0 : 0.001 * (i + 1);
    }
    s->scene =
        text_scene("Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 9 Camera \"perspective\" WorldBegin\n"
                   "Shape \"sphere\" \"float radius\" 5",
                   NULL, NULL);
    s->render = (struct pt_render){
        .config = {.width = 24,
                   .height = 9,
                   .block_width = 8,
                   .block_height = 4,
                   .integrator = {.max_depth = 2, .rr_depth = 9, .max_component = INFINITY}},
        .scene = s->scene,
        .threads = base_threads_create(2, NULL),
        .criterion = s->criterion,
        .busy_threads = 1.84,
        .film = {.x1 = 24, .y1 = 9, .pixels = 200, .bytes = 34567890, .color = s->black, .dropped = s->no_drops},
        .frame = frame,
        .blocks = lull_host_blocks_of(frame),
        .totals = lull_host_totals_of(frame)};
    pt_host_show(&s->render.film, &s->render.shown);
    assert_non_null(s->render.threads);
    s->render.totals->samples = 4321;
    s->render.totals->render_s = 50.5;
    s->render.totals->criterion_s = 60.75;
}

void pt_seven_blocks_release(struct pt_seven_blocks *s)
{
    lull_host_end(s->render.frame);
    lull_host_close(s->criterion);
    pt_scene_destroy(s->scene);
    base_threads_destroy(s->render.threads);
}
