/* A mask: the qualities that its greys ask for, and an instance of the criterion for each. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "support/api_host_film.h"

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

/* Renderers set the locale of their windows: numbers for criteria keep their point, and theirs its comma. */
static void numbers_have_a_point_in_every_locale(void **state)
{
    (void)state;
    char folder[] = "/tmp/lull-locale-XXXXXX", command[160], value[32], text[32], shown[8];
    struct lull_pair quality, given = {"visible", "0.4"};
    err = (struct lull_error){.struct_size = sizeof err};
    assert_non_null(mkdtemp(folder));
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 2>/dev/null", folder);
    const int made = system(command) != -1; /* it also complains of what does not matter */
    setenv("LOCPATH", folder, 1);
    const int set = made && setlocale(LC_ALL, "de_DE.UTF-8") != NULL;
    snprintf(shown, sizeof shown, "%g", 0.5);
    const int32_t code = lull_host_scale_quality(&table, &given, 1, 8, value, &quality, &err);
    const int number = lull_host_number(2.5, text);
    setlocale(LC_ALL, "C");
    snprintf(command, sizeof command, "rm -rf %s", folder);
    assert_int_equal(system(command), 0);
    assert_int_equal(code, LULL_OK);
    assert_true(fabs(strtod(value, NULL) - 0.1) < 1e-16 && number);
    assert_string_equal(text, "2.5");
    if (!set)
        skip(); /* Debian's package locales has it */
    assert_string_equal(shown, "0,5");
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(qualities),
        cmocka_unit_test(numbers_have_a_point_in_every_locale),
        cmocka_unit_test(every_step_has_its_instance),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
