/* A quote as people and programs read it: text, JSON, picture. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "render/quote.h"
#include "picture/read.h"
#include "support/approve.h"
#include "support/pt_seven_blocks.h"

static struct pt_seven_blocks seven;
static struct pt_quote quote;
static struct lull_host_quote_row rows[3];
static struct lull_host_quote_block answers[3][7];

static void fill_row(struct lull_host_quote_row *row, int k)
{
    *row = (struct lull_host_quote_row){.asked = k == 1,
                                        .blocks = answers[k],
                                        .spp_min = 12.4 + k,
                                        .spp_mean = 1234.6 * (k + 1),
                                        .spp_max = 99999.5 * (k + 1),
                                        .spp_mean_low = 1000 + k,
                                        .spp_mean_high = 2000 + k,
                                        .thread_s = 40 + k,
                                        .thread_low_s = 30 + k,
                                        .thread_high_s = 60 + k,
                                        .against_uniform = 0.25 * (k + 1),
                                        .unmet = (uint32_t)k,
                                        .capped = k == 2 ? 5 : 0,
                                        .parameter = k == 0 ? "error" : "visible",
                                        .value = (double[]){4, 0.125, 0.05}[k],
                                        .name = (const char *[]){"draft", "as asked", "strict"}[k],
                                        .told = 1};
    const double walls[3][3] = {{9.94, 0.04, 9.96}, {99.4, 99.6, 9.96 * 60}, {99.4 * 60, 99.6 * 60, 123456}};
    row->wall_s = walls[k][0];
    row->wall_low_s = walls[k][1];
    row->wall_high_s = walls[k][2];
    for (int i = 0; i < 7; i++) {
        static const double share[7] = {3, 9, 1, 7, 5, 9, 2};
        answers[k][i] = (struct lull_host_quote_block){{100.0 * (i + 1) + k, 90.0 * (i + 1), 12345.0 * (i + 1), i != 2},
                                                       share[i],
                                                       share[i] / 2,
                                                       share[i] * 2,
                                                       0.25 * (i + 1),
                                                       k > 0 && i < 2 * k};
    }
}

static int set_up_quote(void **state)
{
    (void)state;
    pt_seven_blocks_init(&seven);
    quote = (struct pt_quote){.row_count = 3, .rows = rows, .threads = 2};
    for (int k = 0; k < 3; k++)
        fill_row(&rows[k], k);
    return 0;
}

static int tear_down_quote(void **state)
{
    (void)state;
    pt_seven_blocks_release(&seven);
    return 0;
}

static char *print_quote(struct approve_case *c)
{
    char *text = NULL;
    size_t size;
    struct base_err err = {0};
    const struct pt_quote_info info = {.scene = "dir/a.pbrt",
                                       .scene_bytes = 98765432,
                                       .load_s = 12.3456,
                                       .interrupted = strstr(c->text, "interrupted") != NULL};
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    rows[1].unknown = strstr(c->text, "unknown") ? 2 : 0;
    rows[1].parameter = strstr(c->text, "uniform") ? NULL : strstr(c->text, "threshold") ? "threshold" : "visible";
    rows[1].value = strstr(c->text, "default") ? 0.25 : 0.125;
    rows[1].name = strstr(c->text, "default") ? "default" : "as asked";
    rows[1].unmet = strstr(c->text, "met") ? 0 : 1;
    rows[1].told = rows[2].told = strstr(c->text, "untold") ? 0 : 1;
    quote.threads = strstr(c->text, "one-thread") ? 1 : 2;
    seven.render.criterion = strstr(c->text, "uniform") ? NULL : seven.criterion;
    if (strstr(c->text, "json"))
        assert_int_equal(pt_quote_json(out, &quote, &seven.render, &info, &err), 0);
    else
        pt_quote_text(out, &quote, &seven.render, &info);
    fclose(out);
    return text;
}

static void quotes(void **state)
{
    (void)state;
    approve_cases("tests/unit/pt_quote_output.txt", print_quote);
}

/* The picture of a quote is that of its blocks' times, in minutes when the most expensive one takes one. */
static void quotes_as_pictures(void **state)
{
    (void)state;
    struct base_err err = {0};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pt_quote_output_%ld.png", (long)getpid());
    for (int k = 0; k < 2; k++) {
        struct pic_canvas map;
        double values[7];
        struct pic_image image;
        for (int i = 0; i < 7; i++) {
            double value = answers[1][i].thread_s;
            answers[1][i].thread_s = k ? value * 60 / 9 : value; /* the most expensive: 9 s, or just a minute */
            values[i] = answers[1][i].thread_s / (k ? 60 : 1);
        }
        assert_int_equal(pt_quote_map(path, &quote, &seven.render, &err), 0);
        assert_int_equal(lull_host_paint(seven.render.blocks, values, k ? "min" : "s", &map, NULL), 0);
        assert_int_equal(pic_read(path, &image, &err), 0);
        assert_true(image.width == map.width && image.height == map.height && image.channels == 3 && image.u8);
        assert_memory_equal(image.u8, map.rgb, (size_t)(3 * map.width * map.height));
        pic_release(&image);
        free(map.rgb);
    }
    unlink(path);
    assert_int_equal(pt_quote_map("/missing/q.png", &quote, &seven.render, &err), BASE_EIO);
}

static void durations_and_thousands(void **state)
{
    (void)state;
    char text[32];
    static const struct {
        double s;
        const char *words;
    } times[] = {{0, "0.0 s"},         {9.94, "9.9 s"},        {9.95, "10 s"},        {99.4, "99 s"},
                 {99.5, "1.7 min"},    {9.94 * 60, "9.9 min"}, {9.95 * 60, "10 min"}, {99.4 * 60, "99 min"},
                 {99.5 * 60, "1.7 h"}, {36000, "10.0 h"}};
    for (size_t i = 0; i < sizeof times / sizeof times[0]; i++)
        assert_string_equal(pt_quote_duration(times[i].s, text), times[i].words);
    static const struct {
        double value;
        int more;
        const char *words;
    } numbers[] = {{0, 0, "0"},   {999.4, 0, "999"}, {1000, 0, "1,000"}, {999999, 1, "999,999+"}, {1234567, 0, "1,234,567"},
                   {12, 1, "12+"}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        assert_string_equal(pt_quote_thousands(numbers[i].value, numbers[i].more, text), numbers[i].words);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(quotes), cmocka_unit_test(quotes_as_pictures),
                                       cmocka_unit_test(durations_and_thousands)};
    return cmocka_run_group_tests(tests, set_up_quote, tear_down_quote);
}
