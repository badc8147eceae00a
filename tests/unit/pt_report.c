/* Everything a render writes, made with an analytic kernel and read back. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include <cjson/cJSON.h>
#include <openexr.h>

#include "base/colour.h"
#include "base/files.h"
#include "base/version.h"
#include "host/frame.h"
#include "picture/draw.h"
#include "picture/read.h"
#include "render/output.h"
#include "support/approve.h"
#include "support/pt_fake.h"

static struct pt_fake_run run;
static char folder[] = "/tmp/pt_report_XXXXXX";
static struct lull_pair param = {"at", "32"};
static struct pt_output_info info;

static const char *in_folder(const char *name)
{
    static char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/* Like pt_fake_nan, but every output is its own function of pixel and sample. */
static void varied(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                   uint32_t sample, struct pt_path_result *out)
{
    pt_fake_nan(scene, settings, x, y, count, sample, out);
    for (int i = 0; i < count; i++, x++, out++) {
        float u = (float)((x * 7 + y * 13 + sample * 29) % 64) / 64.0f;
        out->radiance.z += u;
        out->albedo = v3(u, 0.5f * u, 0.25f + 0.5f * u);
        out->normal_world = v3(1.0f - u, u, -u);
        out->depth = sample % 5 == y % 5 ? INFINITY : 1.0f + (float)x + u;
        out->rays = 1 + (x + y + sample) % 4;
    }
}

/* What a render of `varied` must come to, worked out from the kernel alone. */
struct sums {
    double radiance[3], albedo[3], normal[3], depth, hits, kept, rays;
};

static struct sums sums_of(int x, int y, uint64_t spp)
{
    struct sums s = {0};
    for (uint32_t k = 0; k < spp; k++) {
        struct pt_path_result r;
        varied(NULL, &run.render->config.integrator, (uint32_t)x, (uint32_t)y, 1, k, &r);
        int good = v3_is_finite(r.radiance);
        const float *from[3] = {&r.radiance.x, &r.albedo.x, &r.normal_world.x};
        double *to[3] = {s.radiance, s.albedo, s.normal};
        for (int i = good ? 0 : 1; i < 3; i++)
            for (int c = 0; c < 3; c++)
                to[i][c] += (double)from[i][c];
        if (isfinite(r.depth)) {
            s.depth += (double)r.depth;
            s.hits += 1.0;
        }
        s.kept += good;
        s.rays += r.rays;
    }
    return s;
}

static int setup(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    int crop[4] = {3, 5, 60, 40};
    memcpy(config.crop, crop, sizeof crop);
    config.planes = PT_FILM_AUX;
    info = (struct pt_output_info){.of = {.scene = "dir/fake-view1.pbrt", .kernel = "fake", .scene_bytes = 1000},
                                   .params = &param,
                                   .param_count = 1,
                                   .effects = PT_FX_ALPHA | PT_FX_MOTION};
    if (!mkdtemp(folder))
        return -1;
    run = pt_fake_render(&config, varied, 2, "32");
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    pt_fake_release(&run);
    static const char *const names[] = {"a.exr", "a.png", "s.png", "s.csv", "r.json"};
    for (int i = 0; i < 5; i++)
        unlink(in_folder(names[i]));
    return rmdir(folder); /* fails when a temporary was left behind */
}

/* --- EXR ------------------------------------------------------------------------------------------------------------ */

/* Reads one float channel of the file's only part, data window 57x35 at (3, 5). */
static void read_channel(exr_context_t file, const char *name, float *out)
{
    exr_decode_pipeline_t pipe = EXR_DECODE_PIPELINE_INITIALIZER;
    int32_t lines = 0, found = 0;
    assert_int_equal(exr_get_scanlines_per_chunk(file, 0, &lines), EXR_ERR_SUCCESS);
    for (int y = 5; y < 40; y += lines) {
        exr_chunk_info_t chunk;
        assert_int_equal(exr_read_scanline_chunk_info(file, 0, y, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(
            y == 5 ? exr_decoding_initialize(file, 0, &chunk, &pipe) : exr_decoding_update(file, 0, &chunk, &pipe), 0);
        for (int c = 0; c < pipe.channel_count; c++) {
            int wanted = strcmp(pipe.channels[c].channel_name, name) == 0;
            found += wanted;
            pipe.channels[c].decode_to_ptr = wanted ? (uint8_t *)(out + (size_t)(y - 5) * 57) : NULL;
            pipe.channels[c].user_pixel_stride = 4;
            pipe.channels[c].user_line_stride = 4 * 57;
            pipe.channels[c].user_bytes_per_element = 4;
            pipe.channels[c].user_data_type = EXR_PIXEL_FLOAT;
        }
        if (y == 5)
            assert_int_equal(exr_decoding_choose_default_routines(file, 0, &pipe), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(file, 0, &pipe), EXR_ERR_SUCCESS);
    }
    exr_decoding_destroy(file, &pipe);
    assert_true(found > 0);
}

static void exr_holds_every_layer(void **state)
{
    (void)state;
    struct base_err err = {0};
    static float pixels[57 * 35];
    exr_context_t file = NULL;
    exr_attr_box2i_t window;
    int32_t length;
    const char *text;
    assert_int_equal(pt_output_exr(in_folder("a.exr"), run.render, &info, &err), 0);
    assert_int_equal(exr_start_read(&file, in_folder("a.exr"), NULL), EXR_ERR_SUCCESS);
    assert_int_equal(exr_get_data_window(file, 0, &window), EXR_ERR_SUCCESS);
    assert_true(window.min.x == 3 && window.min.y == 5 && window.max.x == 59 && window.max.y == 39);
    assert_int_equal(exr_get_display_window(file, 0, &window), EXR_ERR_SUCCESS);
    assert_true(window.min.x == 0 && window.max.x == 59 && window.max.y == 43);
    assert_int_equal(exr_attr_get_string(file, 0, "lull:criterion", &length, &text), EXR_ERR_SUCCESS);
    assert_string_equal(text, "fake 1 at=32");
    assert_int_equal(exr_attr_get_string(file, 0, "lull:effects", &length, &text), EXR_ERR_SUCCESS);
    assert_string_equal(text, "alpha,motion");
    assert_int_equal(exr_attr_get_string(file, 0, "lull:block", &length, &text), EXR_ERR_SUCCESS);
    assert_string_equal(text, "16x16");
    static const char *const words[][2] = {
        {"lull:scene", "dir/fake-view1.pbrt"},
        {"software", "lull-render " BASE_VERSION},
        {"lull:reasons", "0=none 1=criterion 2=spp-max 3=uniform 4=time 5=interrupt 6=dropped"}};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(exr_attr_get_string(file, 0, words[i][0], &length, &text), EXR_ERR_SUCCESS);
        assert_string_equal(text, words[i][1]);
    }
    const struct {
        const char *name;
        double value;
    } figures[] = {{"lull:seed", 7},
                   {"lull:samples", (double)run.render->totals->samples},
                   {"lull:seconds", lull_host_elapsed_s(run.render->frame)}};
    for (int i = 0; i < 3; i++) {
        double value = -1;
        assert_int_equal(exr_attr_get_double(file, 0, figures[i].name, &value), EXR_ERR_SUCCESS);
        assert_true(value == figures[i].value);
    }
    static const char *const names[] = {
        "R",        "G",        "B",        "lull.spp.V", "lull.reason.V", "lull.p_noisy.V", "lull.error.V",
        "albedo.R", "albedo.G", "albedo.B", "normal.X",   "normal.Y",      "normal.Z",       "depth.Z"};
    for (int k = 0; k < 14; k++) {
        read_channel(file, names[k], pixels);
        for (int y = 5; y < 40; y++)
            for (int x = 3; x < 60; x++) {
                const struct lull_host_block *b = &run.render->blocks->list[y / 16 * 4 + x / 16];
                const struct sums s = sums_of(x, y, b->spp);
                double n = (double)b->spp;
                const double expected[14] = {s.radiance[0] / s.kept,
                                             s.radiance[1] / s.kept,
                                             s.radiance[2] / s.kept,
                                             s.kept,
                                             x < 16 ? LULL_REASON_DROPPED : LULL_REASON_CRITERION,
                                             1.0 / b->checks,
                                             b->error,
                                             s.albedo[0] / n,
                                             s.albedo[1] / n,
                                             s.albedo[2] / n,
                                             s.normal[0] / n,
                                             s.normal[1] / n,
                                             s.normal[2] / n,
                                             s.depth / s.hits};
                double got = (double)pixels[(y - 5) * 57 + x - 3];
                if (!(fabs(got - expected[k]) <= 2e-7 * fabs(expected[k]))) /* the file holds floats */
                    fail_msg("%s of pixel %d, %d is %.9g, not %.9g", names[k], x, y, got, expected[k]);
            }
    }
    exr_finish(&file);
}

static void exr_of_equal_renders_are_equal(void **state)
{
    (void)state;
    struct base_err err = {0};
    char *a, *b;
    size_t na, nb;
    info.reproducible = 1;
    assert_int_equal(pt_output_exr(in_folder("a.exr"), run.render, &info, &err), 0);
    assert_int_equal(base_file_read(in_folder("a.exr"), 1 << 24, &a, &na, &err), 0);
    run.render->totals->render_s += 1.0;
    assert_int_equal(pt_output_exr(in_folder("a.exr"), run.render, &info, &err), 0);
    assert_int_equal(base_file_read(in_folder("a.exr"), 1 << 24, &b, &nb, &err), 0);
    info.reproducible = 0;
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    free(a);
    free(b);
}

static void unwritable_folder_is_one_line(void **state)
{
    (void)state;
    struct base_err err = {0};
    assert_int_equal(pt_output_exr("/nowhere/a.exr", run.render, &info, &err), BASE_EIO);
    assert_non_null(strstr(err.text, "/nowhere/a.exr"));
    assert_null(strchr(err.text, '\n'));
    assert_int_equal(pt_output_report("/nowhere/a.json", run.render, &info, &err), BASE_EIO);
    assert_int_not_equal(pt_output_preview("/nowhere/a.png", run.render, NULL, &err), 0);
    assert_int_equal(pt_output_stop_map("/nowhere/a.csv", run.render, &info, &err), BASE_EIO);
}

/* --- pictures ------------------------------------------------------------------------------------------------------- */

static void preview_is_srgb(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pic_image image;
    double rgb[3];
    assert_int_equal(pt_output_preview(in_folder("a.png"), run.render, NULL, &err), 0);
    assert_int_equal(pic_read(in_folder("a.png"), &image, &err), 0);
    assert_true(image.width == 57 && image.height == 35 && image.channels == 3 && image.u8);
    pt_film_mean(&run.render->film, pt_film_index(&run.render->film, 13, 15), run.render->blocks->list[0].spp, rgb);
    for (int c = 0; c < 3; c++)
        assert_int_equal(image.u8[3 * (10 * 57 + 10) + c], base_srgb_code(rgb[c]));
    pic_release(&image);
}

static void srgb_codes(void **state)
{
    (void)state;
    assert_int_equal(base_srgb_code(0.0), 0);
    assert_int_equal(base_srgb_code(1.0), 255);
    assert_int_equal(base_srgb_code(7.0), 255);
    assert_int_equal(base_srgb_code(-1.0), 0);
    assert_int_equal(base_srgb_code((double)NAN), 0);
    assert_int_equal(base_srgb_code(0.18), 118);
    assert_int_equal(base_srgb_code(0.5), 188);
    for (int i = 0; i < 256; i++)
        assert_int_equal(base_srgb_code(base_srgb_eotf(i / 255.0)), i);
}

/* Colours lie between the ends of the scale, numbers are drawn, the legend is below. */
static void stop_map_picture(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pic_canvas map;
    struct lull_host_block list[2] = {{.x1 = 200, .y1 = 100}, {.x0 = 200, .x1 = 400, .y1 = 100}};
    const struct lull_host_blocks blocks = {.list = list, .count = 2, .x1 = 400, .y1 = 100};
    const double values[2] = {32, 10000};
    uint8_t low[3], high[3];
    assert_int_equal(lull_host_paint(&blocks, values, "spp", &map, NULL), 0);
    assert_int_equal(map.width, 400);
    assert_true(map.height > 100);
    pic_colour(PIC_VIRIDIS, 0.0, low);
    pic_colour(PIC_VIRIDIS, 1.0, high);
    assert_memory_equal(map.rgb + 3 * (5 * 400 + 5), low, 3);
    assert_memory_equal(map.rgb + 3 * (5 * 400 + 205), high, 3);
    int ink = 0;
    for (int y = 0; y < 100; y++)
        for (int x = 0; x < 199; x++)
            ink += map.rgb[3 * (y * 400 + x)] == 255;
    assert_in_range(ink, 100, 2000);
    free(map.rgb);
    assert_int_equal(pt_output_stop_map(in_folder("s.png"), run.render, &info, &err), 0);
    /* small blocks are enlarged, but not beyond what anybody looks at */
    struct lull_host_block small = {.x1 = 8, .y1 = 8};
    struct lull_host_blocks many = {.list = &small, .count = 1, .x1 = 400, .y1 = 100};
    assert_int_equal(lull_host_paint(&many, values, "spp", &map, NULL), 0);
    assert_int_equal(map.width, 6 * 400);
    free(map.rgb);
    many.x1 = 8192, many.y1 = 4096;
    assert_int_equal(lull_host_paint(&many, values, "spp", &map, NULL), 0);
    assert_int_equal(map.width, 8192);
    free(map.rgb);
}

static void stop_map_table(void **state)
{
    (void)state;
    struct base_err err = {0};
    char *text, expected[512];
    size_t n;
    assert_int_equal(pt_output_stop_map(in_folder("s.csv"), run.render, &info, &err), 0);
    assert_int_equal(base_file_read(in_folder("s.csv"), 4096, &text, &n, &err), 0);
    int used = snprintf(expected, sizeof expected, "fake-view1;");
    for (uint32_t i = 0; i < run.render->blocks->count; i++)
        used += snprintf(expected + used, sizeof expected - (size_t)used, "%llu;",
                         (unsigned long long)run.render->blocks->list[i].spp);
    snprintf(expected + used, sizeof expected - (size_t)used, "\n");
    assert_string_equal(text, expected);
    free(text);
}

/* --- report --------------------------------------------------------------------------------------------------------- */

static double number(const cJSON *o, const char *key)
{
    const cJSON *item = cJSON_GetObjectItem(o, key);
    if (!cJSON_IsNumber(item))
        fail_msg("no number %s", key);
    return item->valuedouble;
}

static const char *words(const cJSON *o, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(o, key));
    assert_non_null(text);
    return text;
}

/* One block of the report against the grid (blocks are whole whatever the crop) and the kernel; adds what it holds to the totals. */
static void check_block(const cJSON *b, int id, struct sums *all, double *samples)
{
    int x0 = id % 4 * 16, y0 = id / 4 * 16, x1 = x0 + 16 < 60 ? x0 + 16 : 60, y1 = y0 + 16 < 44 ? y0 + 16 : 44;
    double spp = number(b, "spp"), red = 0.0;
    assert_true(number(b, "id") == id && number(b, "x0") == x0 && number(b, "y0") == y0 && number(b, "x1") == x1 &&
                number(b, "y1") == y1);
    int at = 32 * (1 + id % 4), dropped = x0 == 0; /* those ask twice */
    assert_true(spp >= at && spp < (dropped ? 4 : 2) * at);
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            struct sums s = sums_of(x, y, (uint64_t)spp);
            all->kept += s.kept;
            all->rays += s.rays;
            *samples += spp;
            red += s.radiance[0] / s.kept / ((x1 - x0) * (y1 - y0));
        }
    assert_string_equal(words(b, "reason"), dropped ? "dropped" : "criterion");
    assert_true(fabs(number(b, "error") - red) < 1e-12); /* the fake criterion's: the mean of red as it was shown */
    assert_true(number(b, "checks") >= 1 && fabs(number(b, "p_noisy") * number(b, "checks") - 1.0) < 1e-14);
    assert_true(number(b, "thread_s") > 0.0 && number(b, "thread_s") < 60.0);
}

static void check_totals(const cJSON *root, const struct sums *all, double samples)
{
    const cJSON *t = cJSON_GetObjectItem(root, "totals"), *d;
    double threads_s = 0.0;
    assert_true(number(t, "samples") == samples && number(t, "paths") == samples && number(t, "rays") == all->rays);
    assert_true(number(t, "dropped_samples") == samples - all->kept && samples > all->kept);
    assert_true(number(t, "render_s") > 0.0 && number(t, "criterion_s") > 0.0);
    assert_true(fabs(number(t, "paths_per_s") * number(t, "render_s") / samples - 1.0) < 1e-6);
    assert_true(fabs(number(t, "rays_per_s") * number(t, "render_s") / all->rays - 1.0) < 1e-6);
    cJSON_ArrayForEach (d, cJSON_GetObjectItem(root, "blocks"))
        threads_s += number(d, "thread_s");
    assert_true(threads_s <= 2.0 * number(t, "render_s"));
    assert_true(cJSON_GetArraySize(cJSON_GetObjectItem(root, "dropped")) > 0);
    cJSON_ArrayForEach (d, cJSON_GetObjectItem(root, "dropped")) {
        struct pt_path_result r;
        varied(NULL, &run.render->config.integrator, (uint32_t)number(d, "x"), (uint32_t)number(d, "y"), 1,
               (uint32_t)number(d, "sample"), &r);
        assert_false(v3_is_finite(r.radiance));
    }
}

static void report_is_what_happened(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct sums all = {0};
    double samples = 0.0;
    char *text;
    size_t n;
    assert_int_equal(pt_output_report(in_folder("r.json"), run.render, &info, &err), 0);
    assert_int_equal(base_file_read(in_folder("r.json"), 1 << 20, &text, &n, &err), 0);
    cJSON *root = cJSON_Parse(text);
    assert_non_null(root);
    assert_string_equal(words(root, "scene"), "dir/fake-view1.pbrt");
    assert_string_equal(words(root, "kernel"), "fake");
    assert_true(number(root, "width") == 60 && number(root, "height") == 44 && number(root, "block") == 16 &&
                number(root, "seed") == 7);
    assert_true(number(root, "threads") == 2 && cJSON_IsFalse(cJSON_GetObjectItem(root, "interrupted")));
    const cJSON *by = cJSON_GetObjectItem(root, "criterion"), *effects = cJSON_GetObjectItem(root, "effects");
    assert_string_equal(words(by, "id"), "fake");
    assert_string_equal(words(by, "version"), "1");
    assert_string_equal(words(cJSON_GetObjectItem(by, "params"), "at"), "32");
    assert_int_equal(cJSON_GetArraySize(effects), 2);
    assert_string_equal(cJSON_GetStringValue(cJSON_GetArrayItem(effects, 0)), "alpha");
    assert_string_equal(cJSON_GetStringValue(cJSON_GetArrayItem(effects, 1)), "motion");
    const cJSON *blocks = cJSON_GetObjectItem(root, "blocks"), *memory = cJSON_GetObjectItem(root, "memory");
    assert_int_equal(cJSON_GetArraySize(blocks), 12);
    for (int id = 0; id < 12; id++)
        check_block(cJSON_GetArrayItem(blocks, id), id, &all, &samples);
    check_totals(root, &all, samples);
    assert_true(number(memory, "film_bytes_per_pixel") == 124 && number(memory, "film_bytes") == 124 * 60 * 44 &&
                number(memory, "scene_bytes") == 1000);
    cJSON_Delete(root);
    free(text);
}

/* The report of the render with times that are known. */
static char *report_of(struct approve_case *c)
{
    struct base_err err = {0};
    char *text;
    size_t n;
    int alone = strstr(c->text, "uniform") != NULL;
    struct pt_render r = *run.render;
    struct lull_host_frame frame = *run.render->frame;
    struct lull_host_block list[12];
    struct pt_output_info told = info;
    memcpy(list, run.render->blocks->list, sizeof list);
    for (int i = 0; i < 12; i++) {
        list[i].thread_s = 0.25 * (i + 1);
        list[i].reason = alone ? i % LULL_REASON_COUNT : list[i].reason;
    }
    r.frame = &frame;
    frame.blocks.list = list;
    frame.totals.criterion_thread_s = 3.5;
    frame.totals.render_s = alone ? 0 : 8;
    frame.totals.criterion_s = 1.25;
    frame.dropped_count = 0;
    for (uint32_t k = 0; k < 6 && !alone; k += 3)
        lull_host_drop(&frame, k + 1, k + 2, k + 3);
    if (alone) {
        frame.criterion = NULL;
        frame.answer_room = 0; /* they stand in the case before */
        frame.blocks.block_height = 8;
        r.threads = base_threads_create(9, &err);
        told = (struct pt_output_info){.of = {.flags = LULL_REPORT_INTERRUPTED,
                                              .scene = "a \"b\".pbrt",
                                              .mask = "m.png",
                                              .kernel = "k",
                                              .scene_bytes = (double)NAN},
                                       .effects = PT_FX_ALL};
    }
    if (strstr(c->text, "empty"))
        told.of.scene_bytes = 0;
    assert_int_equal(pt_output_report(in_folder("r.json"), &r, &told, &err), 0);
    if (alone)
        base_threads_destroy(r.threads);
    assert_int_equal(base_file_read(in_folder("r.json"), 1 << 20, &text, &n, &err), 0);
    return text;
}

static void report_word_for_word(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_report.txt", report_of);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exr_holds_every_layer),
        cmocka_unit_test(exr_of_equal_renders_are_equal),
        cmocka_unit_test(unwritable_folder_is_one_line),
        cmocka_unit_test(preview_is_srgb),
        cmocka_unit_test(srgb_codes),
        cmocka_unit_test(stop_map_picture),
        cmocka_unit_test(stop_map_table),
        cmocka_unit_test(report_is_what_happened),
        cmocka_unit_test(report_word_for_word),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
