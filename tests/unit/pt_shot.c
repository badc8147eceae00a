/* Frames that belong together: lists of them, names, seeds, a path of the camera, what blocks need between two pilots, and the table. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "app/frame.h"
#include "base/files.h"
#include "sample/sampler.h"

static void lists_of_frames(void **state)
{
    static const struct {
        const char *text;
        size_t count;
        int last;
    } good[] = {{"1-24", 24, 24}, {"1,5,9", 3, 9}, {"1-24:2", 12, 23},
                {"0", 1, 0},      {"3-3", 1, 3},   {"1-4,6-9:3,100", 7, 100}};
    static const char *const bad[] = {
        "",    "1,",  ",1",    "3-1",     "1-", "1-3:0", "1:",       "a",     "1 2",       "-1",
        "2,2", "5,3", "1-4,4", "1-24:2x", "+1", "0x1",   "99999999", "1-3-5", "0-9999999", "18446744073709551617"};
    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        struct pt_shot s = {0};
        assert_int_equal(pt_shot_parse_frames(good[i].text, &s, NULL), 0);
        assert_int_equal(s.count, good[i].count);
        assert_int_equal(s.frames[s.count - 1], good[i].last);
        pt_shot_release(&s);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct pt_shot s = {0};
        struct base_err err = {0};
        if (pt_shot_parse_frames(bad[i], &s, &err) != BASE_EINVAL || !strstr(err.text, bad[i]))
            fail_msg("'%s' is taken for a list", bad[i]);
        pt_shot_release(&s);
    }
}

static void names_of_frames(void **state)
{
    char name[32];
    (void)state;
    assert_int_equal(pt_frame_name("a_%04d.exr", 7, name, sizeof name, NULL), 0);
    assert_string_equal(name, "a_0007.exr");
    assert_int_equal(pt_frame_name("%d/x", 123456, name, sizeof name, NULL), 0);
    assert_string_equal(name, "123456/x");
    assert_int_equal(pt_frame_name("50%/%d%s/%03d.exr", 7, name, sizeof name, NULL), 0);
    assert_string_equal(name, "50%/%d%s/007.exr");
    assert_int_equal(pt_frame_name("50%/a.pbrt", 7, name, sizeof name, NULL), 0);
    assert_string_equal(name, "50%/a.pbrt");
    assert_true(pt_frame_has_number("50%/%d") && pt_frame_has_number("%04d/a") && pt_frame_has_number("%s"));
    assert_true(!pt_frame_has_number("50%/a") && !pt_frame_has_number("a"));
    assert_int_equal(pt_frame_name("still.pbrt", 7, name, sizeof name, NULL), 0);
    assert_string_equal(name, "still.pbrt");
    static const char *const bad[] = {"%", "%s", "%n", "%4d", "%0d", "%012d", "%%d", "%d%d", "%d%n", "%ld", "%04"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (pt_frame_name(bad[i], 1, name, sizeof name, NULL) != BASE_EINVAL)
            fail_msg("'%s' is taken for a name", bad[i]);
    assert_int_equal(pt_frame_name("a_name_that_is_too_long_for_32.exr", 1, name, sizeof name, NULL), BASE_EINVAL);
}

/* Mean over `frames` frames of what each pixel of a still scene gets, 4 samples of a product of two numbers; the variance over
 * pixels. */
static double variance_of_mean(int frames, int same_seed)
{
    enum { PIXELS = 4096, SPP = 4 };
    double sum = 0.0, square = 0.0;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
        double mean = 0.0;
        for (int f = 0; f < frames; f++)
            for (uint32_t i = 0; i < SPP; i++) {
                uint32_t seed = same_seed ? 3 : pt_frame_seed(3, f);
                struct pt_sampler s = pt_sampler_make(1, seed, pixel % 64, pixel / 64, i);
                struct pt_sample2 p = pt_sampler_2d(&s, PT_DIM_PIXEL);
                mean += (double)(p.x * p.y) / (SPP * frames);
            }
        sum += mean / PIXELS;
        square += mean * mean / PIXELS;
    }
    return square - sum * sum;
}

/* The variance of a mean over frames falls as 1/frames; six standard errors of a ratio of two variances over 4,096 pixels. */
static void fresh_seeds_are_independent(void **state)
{
    const double one = variance_of_mean(1, 0), off = 6.0 * sqrt(4.0 / 4096);
    (void)state;
    for (int frames = 4; frames <= 16; frames *= 4) {
        double fall = one / variance_of_mean(frames, 0) / frames;
        if (!(fall > 1.0 - off && fall < 1.0 + off))
            fail_msg("over %d frames the variance falls by %g times as much as it should", frames, fall);
    }
    assert_true(fabs(variance_of_mean(4, 1) / variance_of_mean(1, 1) - 1.0) < 1e-9); /* one seed: nothing falls */
}

static void no_two_frames_have_one_seed(void **state)
{
    enum { SEEDS = 8, FRAMES = 512 };
    static uint32_t seeds[SEEDS * FRAMES];
    (void)state;
    for (uint32_t s = 0; s < SEEDS; s++)
        for (int f = 0; f < FRAMES; f++)
            seeds[s * FRAMES + (uint32_t)f] = pt_frame_seed(s, f);
    for (int i = 0; i < SEEDS * FRAMES; i++)
        for (int k = 0; k < i; k++)
            assert_int_not_equal(seeds[i], seeds[k]);
}

static void paths_of_the_camera(void **state)
{
    static const char good[] = "\xef\xbb\xbf" /* as spreadsheets of Windows write it */
                               "frame;eye;at;up;fov\r\n3;0 1 5;0 0 0;0 1 0;45\n10; 1 1 5 ; 0 0 0;0 1 0;\n";
    static const char *const bad[][2] = {
        {"", "expected frame;eye;at;up;fov"},
        {"frame;eye;at;up;fov\n", "a line for each frame"},
        {"frame,eye,at,up,fov\n1,2\n", ":1: expected frame;eye;at;up;fov"},
        {"frame;eye;at;up;fov\n1;0 1 5;0 0 0;0 1 0\n", ":2: expected five fields"},
        {"frame;eye;at;up;fov\n1;0 1 5;0 0 0;0 1 0;45;\n", "expected a field of view"},
        {"frame;eye;at;up;fov\n1;0 1 5;0 0 0;0 1;45\n", ":2: expected nine numbers"},
        {"frame;eye;at;up;fov\n1;0 1 5;0 1 5;0 1 0;45\n", ":2: expected eye and point looked at apart"},
        {"frame;eye;at;up;fov\n1;0 1 5;0 0 0;0 1 0;180\n", "expected a field of view"},
        {"frame;eye;at;up;fov\nx;0 1 5;0 0 0;0 1 0;45\n", "expected a frame"},
        {"frame;eye;at;up;fov\n2;0 1 5;0 0 0;0 1 0;45\n2;0 1 5;0 0 0;0 1 0;45\n", ":3: expected rising frames"}};
    struct pt_shot s = {0};
    (void)state;
    assert_int_equal(pt_shot_parse_path("p.csv", good, sizeof good - 1, &s, NULL), 0);
    assert_int_equal(s.count, 2);
    assert_int_equal(s.frames[1], 10);
    assert_true(s.views[0].has_look_at && s.views[0].look_at_world[2] == 5.0 && s.views[0].look_at_world[7] == 1.0);
    assert_true(s.views[0].fov_deg == 45.0 && s.views[1].fov_deg == 0.0);
    pt_shot_release(&s);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct base_err err = {0};
        if (pt_shot_parse_path("p.csv", bad[i][0], strlen(bad[i][0]), &s, &err) != BASE_EINVAL ||
            !strstr(err.text, bad[i][1]))
            fail_msg("path %zu: %s", i, err.text);
        pt_shot_release(&s);
    }
}

enum { COLUMNS = 4, BLOCKS = 12 };

static void set_need(struct lull_host_quote_block *b, double spp)
{
    b->stop = (struct lull_host_stop_at){spp, spp / 1.2, spp * 1.2, 1};
}

static void needs_between_pilots(void **state)
{
    struct lull_host_quote_block a[BLOCKS], b[BLOCKS];
    (void)state;
    for (int i = 0; i < BLOCKS; i++) {
        set_need(&a[i], 100.0 + i);
        set_need(&b[i], 110.0 + i);
    }
    set_need(&a[3], 900.0); /* stands still */
    set_need(&b[3], 950.5);
    set_need(&a[4], 800.0); /* is over in the second */
    assert_int_equal(lull_host_quote_between(a, b, BLOCKS, COLUMNS, 3), 951);
    assert_int_equal(lull_host_quote_between(a, b, BLOCKS, COLUMNS, 2), 112); /* beside 3 */
    static const int near_4[] = {0, 1, 4, 5, 8, 9}, far_from_4[] = {2, 6, 7, 10, 11};
    for (size_t i = 0; i < sizeof near_4 / sizeof *near_4; i++) { /* half the way there, in octaves */
        double own = near_4[i] == 4 ? 800.0 : 110.0 + near_4[i];
        assert_int_equal(lull_host_quote_between(a, b, BLOCKS, COLUMNS, (uint32_t)near_4[i]),
                         (uint32_t)ceil(sqrt(own * 800.0)));
    }
    for (size_t i = 0; i < sizeof far_from_4 / sizeof *far_from_4; i++) /* nor across the picture's edge */
        assert_int_equal(lull_host_quote_between(a, b, BLOCKS, COLUMNS, (uint32_t)far_from_4[i]), 110 + far_from_4[i]);
    set_need(&b[7], 10.0); /* moves beside what stands still */
    assert_int_equal(lull_host_quote_between(a, b, BLOCKS, COLUMNS, 7), 107);
    assert_int_equal(lull_host_quote_between(b, b, BLOCKS, COLUMNS, 7), 10); /* a pilot with itself: one frame is a still */
}

static const char table_text[] = "lull-shot-table 1\nsize=4x2 crop=0,0,4,2 block=2x2\n0;1;2147483647\n12;30;4\n";

static void tables_come_back(void **state)
{
    char path[] = "/tmp/pt_shot_XXXXXX";
    struct pt_shot_table t;
    char *text;
    size_t size;
    (void)state;
    assert_int_equal(pt_shot_table_parse("t", table_text, sizeof table_text - 1, &t, NULL), 0);
    assert_int_equal(t.block_count, 2);
    assert_int_equal(pt_shot_table_frame(&t, 12)[0], 30);
    assert_int_equal(pt_shot_table_frame(&t, 0)[1], 2147483647);
    assert_null(pt_shot_table_frame(&t, 1));
    close(mkstemp(path));
    assert_int_equal(pt_shot_table_write(path, &t, NULL), 0);
    pt_shot_table_release(&t);
    assert_int_equal(base_file_read(path, 1000, &text, &size, NULL), 0);
    assert_string_equal(text, table_text);
    free(text);
    unlink(path);
}

/* text with `line_end` in the place of each '\n'. */
static size_t with_ends(const char *text, const char *line_end, char *to)
{
    const char *begin = to;
    for (; *text != '\0'; text++)
        to += sprintf(to, "%.*s", *text == '\n' ? 2 : 1, *text == '\n' ? line_end : text);
    return (size_t)(to - begin);
}

static void lines_end_as_they_like(void **state)
{
    static const char *const ends[] = {"\n", "\r\n", "\r"};
    static const char path[] = "frame;eye;at;up;fov\n1;0 1 5;0 0 0;0 1 0;45\n2;0 1 4;0 0 0;0 1 0;45\n";
    char text[256];
    (void)state;
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        struct pt_shot_table t;
        struct pt_shot s = {0};
        size_t size = with_ends(table_text, ends[i], text);
        assert_int_equal(pt_shot_table_parse("t", text, size, &t, NULL), 0);
        assert_int_equal(strncmp(t.grid, table_text + sizeof "lull-shot-table 1", strlen(t.grid)), 0);
        assert_int_equal(t.frame_count, 2);
        assert_int_equal(pt_shot_table_frame(&t, 12)[1], 4);
        pt_shot_table_release(&t);
        size = with_ends(path, ends[i], text);
        assert_int_equal(pt_shot_parse_path("p", text, size, &s, NULL), 0);
        assert_int_equal(s.count, 2);
        assert_true(s.views[1].look_at_world[2] == 4.0);
        pt_shot_release(&s);
        text[size - 8] = '\0';
        assert_int_equal(pt_shot_parse_path("p", text, size, &s, NULL), BASE_EINVAL);
        pt_shot_release(&s);
    }
}

static void bad_tables_are_one_line(void **state)
{
    static const struct {
        const char *from, *to, *says;
    } bad[] = {{"lull-shot", "full-shot", "t:1: "},
               {"12;", "0;", "t:4: "},
               {";30;", ";0;", "t:4: "},
               {";30;", ";-3;", "t:4: "},
               {";30;", ";2147483648;", "t:4: "},
               {";30;", ";30;5;", "t: "},
               {";30;4\n", ";30;4", "t:4: "},
               {";30;", ";3x;", "t:4: "},
               {"0;1;2147483647\n", "\n", "t:3: "},
               {"12;30", "12,30", "t: "},
               {"12;", ";12", "t:4: "},
               {";4\n", ";\n", "t:4: "},
               {";4\n", ";4\nx", "t: "}};
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char text[256];
        const char *at = strstr(table_text, bad[i].from);
        struct pt_shot_table t;
        struct base_err err = {0};
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - table_text), table_text, bad[i].to, at + strlen(bad[i].from));
        int rc = pt_shot_table_parse("t", text, strlen(text), &t, &err);
        if (rc != BASE_EINVAL || strncmp(err.text, bad[i].says, strlen(bad[i].says)) != 0)
            fail_msg("%s for %s: %s", bad[i].to, bad[i].from, err.text);
        pt_shot_table_release(&t);
    }
    for (size_t n = 0; n + 1 < sizeof table_text; n++) { /* every beginning of it */
        struct pt_shot_table t;
        int rc = pt_shot_table_parse("t", table_text, n, &t, NULL);
        assert_int_equal(rc, n > 0 && table_text[n - 1] == '\n' && n > 60 ? 0 : BASE_EINVAL);
        pt_shot_table_release(&t);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lists_of_frames),
        cmocka_unit_test(names_of_frames),
        cmocka_unit_test(fresh_seeds_are_independent),
        cmocka_unit_test(no_two_frames_have_one_seed),
        cmocka_unit_test(paths_of_the_camera),
        cmocka_unit_test(needs_between_pilots),
        cmocka_unit_test(tables_come_back),
        cmocka_unit_test(lines_end_as_they_like),
        cmocka_unit_test(bad_tables_are_one_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
