/* The criterion "ggn": what a model says where a host gives no half buffers. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <lull/loader.h>

#include "support/api_folders.h"

static int32_t side = 200, transfer = LULL_TRANSFER_SRGB; /* of the frame */

static const char with_picture[] = "tests/data/tiny.ggn",
                  without_picture[] = "tests/data/no-picture.ggn"; /* a step or two */
static char criteria[2048], warning[512];
static int32_t warning_level;

static void log_line(const struct lull_host *host, int32_t level, const char *text)
{
    (void)host;
    warning_level = level;
    snprintf(warning, sizeof warning, "%s", text);
}

/* What is logged when a frame with these planes begins. model NULL: the one that is shipped. */
static const char *warned(const char *model, uint32_t planes)
{
    static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1, .log = log_line};
    const char *dirs[] = {criteria};
    struct lull_search search = {.dirs = dirs, .dir_count = 1};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;
    struct lull_pair pair = {"model", model};
    struct lull_rect rect = {0, 0, side, side};
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .width = (uint32_t)side,
                               .height = (uint32_t)side,
                               .blocks = &rect,
                               .block_count = 1,
                               .block_stride = sizeof rect,
                               .planes = planes,
                               .exposure = 1,
                               .transfer = transfer,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
    warning[0] = '\0';
    if (lull_open(&search, "ggn", &found, &err) != LULL_OK ||
        found.criterion->create(&host, &pair, model ? 1 : 0, sizeof pair, &in, &err) != LULL_OK ||
        found.criterion->begin_frame(in, &frame, &err) != LULL_OK)
        fail_msg("%s", err.message);
    found.criterion->destroy(in);
    return warning;
}

static void a_missing_half_is_told(void **state)
{
    const uint32_t color = LULL_PLANE_BIT(LULL_PLANE_COLOR), half = LULL_PLANE_BIT(LULL_PLANE_HALF);
    (void)state;
    assert_string_equal(warned(NULL, color | half), "");
    assert_non_null(strstr(warned(NULL, color), "no plane HALF: noise is told from how the mean changes"));
    assert_int_equal(warning_level, LULL_LOG_INFO);
    side = 16;
    assert_string_equal(warned(with_picture, color | half), "");
    assert_string_equal(warned(with_picture, color), "");
    side = 40;
    assert_string_equal(warned(without_picture, color | half), "");
    assert_string_equal(warned(without_picture, color), "");
}

/* Blocks of another size and another display are told, too: quietly where the model begins with the observer. */
static void another_setting_is_told(void **state)
{
    const uint32_t both = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF);
    (void)state;
    side = 64;
    transfer = LULL_TRANSFER_LINEAR;
    assert_string_equal(warned(without_picture, both), "the model is asked about what it has not learned: blocks of 64x64 "
                                                       "pixels instead of 40x40, linear codes instead of sRGB");
    assert_int_equal(warning_level, LULL_LOG_WARNING);
    assert_string_equal(warned(NULL, both), "the model is asked about what it has not learned: blocks of 64x64 "
                                            "pixels instead of 200x200, linear codes instead of sRGB");
    assert_int_equal(warning_level, LULL_LOG_DEBUG);
}

/* The last value that each parameter takes, and the first that it does not. */
static void ends_of_ranges(void **state)
{
    static const char *const cases[][3] = {{"first-spp", "1", "0"},
                                           {"first-spp", "1000000000", "1000000001"},
                                           {"visible", "1", "1.01"},
                                           {"visible", "0", "-0.1"},
                                           {"passes", "1", "0"}};
    const char *dirs[] = {criteria};
    struct lull_search search = {.dirs = dirs, .dir_count = 1};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    (void)state;
    assert_int_equal(lull_open(&search, "ggn", &found, &err), LULL_OK);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        for (int bad = 0; bad < 2; bad++) {
            struct lull_instance *in = NULL;
            struct lull_pair pair = {cases[i][0], cases[i][1 + bad]};
            int32_t status = found.criterion->create(NULL, &pair, 1, sizeof pair, &in, &err);
            if (status != (bad ? LULL_E_VALUE : LULL_OK))
                fail_msg("%s=%s: %d", pair.key, pair.value, status);
            if (!bad)
                found.criterion->destroy(in);
        }
}

int main(void)
{
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return 1;
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_missing_half_is_told), cmocka_unit_test(another_setting_is_told),
                                       cmocka_unit_test(ends_of_ranges)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
