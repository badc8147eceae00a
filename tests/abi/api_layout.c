/*
 * The ABI's layout, field by field, against the frozen plugin-api/layout-1.txt. Run from the root of the source tree;
 * `api_layout --print` prints the present layout instead.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <lull/criterion.h>

struct field {
    const char *name;
    size_t offset, size;
};

struct layout {
    const char *name;
    size_t size;
    const struct field *fields;
    size_t count;
};

#define F(T, field)                                                                                                         \
    {                                                                                                                       \
#field, offsetof(struct T, field), sizeof(((struct T *)0)->field)                                                   \
    }
#define LAYOUT(T, ...) static const struct field T##_fields[] = {__VA_ARGS__}
#define ENTRY(T)                                                                                                            \
    {                                                                                                                       \
#T, sizeof(struct T), T##_fields, sizeof T##_fields / sizeof *T##_fields                                            \
    }

LAYOUT(lull_error, F(lull_error, struct_size), F(lull_error, code), F(lull_error, message));
LAYOUT(lull_host, F(lull_host, struct_size), F(lull_host, api_minor), F(lull_host, context), F(lull_host, name),
       F(lull_host, max_workers), F(lull_host, flags), F(lull_host, log), F(lull_host, parallel_for),
       F(lull_host, cancelled), F(lull_host, get_extension));
LAYOUT(lull_param, F(lull_param, name), F(lull_param, help), F(lull_param, default_value), F(lull_param, choices),
       F(lull_param, min), F(lull_param, max), F(lull_param, type), F(lull_param, flags));
LAYOUT(lull_pair, F(lull_pair, key), F(lull_pair, value));
LAYOUT(lull_requirements, F(lull_requirements, struct_size), F(lull_requirements, flags),
       F(lull_requirements, planes_required), F(lull_requirements, planes_used), F(lull_requirements, block_width),
       F(lull_requirements, block_height), F(lull_requirements, halo), F(lull_requirements, checks_hint),
       F(lull_requirements, first_spp), F(lull_requirements, bytes_per_block));
LAYOUT(lull_rect, F(lull_rect, x0), F(lull_rect, y0), F(lull_rect, x1), F(lull_rect, y1));
LAYOUT(lull_frame, F(lull_frame, struct_size), F(lull_frame, flags), F(lull_frame, width), F(lull_frame, height),
       F(lull_frame, blocks), F(lull_frame, block_count), F(lull_frame, block_stride), F(lull_frame, planes),
       F(lull_frame, transfer), F(lull_frame, gamma), F(lull_frame, exposure), F(lull_frame, sample_clamp),
       F(lull_frame, time_budget_s), F(lull_frame, spp_min), F(lull_frame, spp_max), F(lull_frame, seed),
       F(lull_frame, rgb_to_xyz));
LAYOUT(lull_plane, F(lull_plane, data), F(lull_plane, stride_x), F(lull_plane, stride_y), F(lull_plane, stride_c),
       F(lull_plane, scale), F(lull_plane, type), F(lull_plane, normaliser), F(lull_plane, channels), F(lull_plane, flags));
LAYOUT(lull_block, F(lull_block, id), F(lull_block, flags), F(lull_block, x0), F(lull_block, y0), F(lull_block, x1),
       F(lull_block, y1), F(lull_block, spp), F(lull_block, half_spp), F(lull_block, thread_s));
LAYOUT(lull_view, F(lull_view, struct_size), F(lull_view, flags), F(lull_view, x0), F(lull_view, y0), F(lull_view, x1),
       F(lull_view, y1), F(lull_view, planes), F(lull_view, plane_count), F(lull_view, plane_stride), F(lull_view, all),
       F(lull_view, all_count), F(lull_view, all_stride), F(lull_view, elapsed_s));
LAYOUT(lull_decision, F(lull_decision, action), F(lull_decision, flags), F(lull_decision, next_spp),
       F(lull_decision, p_noisy), F(lull_decision, predicted_spp), F(lull_decision, error));
LAYOUT(lull_criterion, F(lull_criterion, struct_size), F(lull_criterion, api_minor), F(lull_criterion, id),
       F(lull_criterion, name), F(lull_criterion, version), F(lull_criterion, description), F(lull_criterion, params),
       F(lull_criterion, param_count), F(lull_criterion, param_stride), F(lull_criterion, thread_level),
       F(lull_criterion, capabilities), F(lull_criterion, create), F(lull_criterion, requirements),
       F(lull_criterion, begin_frame), F(lull_criterion, evaluate), F(lull_criterion, end_frame), F(lull_criterion, destroy),
       F(lull_criterion, get_extension));
LAYOUT(lull_writer, F(lull_writer, struct_size), F(lull_writer, flags), F(lull_writer, context), F(lull_writer, write));
LAYOUT(lull_reader, F(lull_reader, struct_size), F(lull_reader, flags), F(lull_reader, context), F(lull_reader, read));
LAYOUT(lull_state, F(lull_state, struct_size), F(lull_state, flags), F(lull_state, save), F(lull_state, load));

static const struct layout layouts[] = {
    ENTRY(lull_error),    ENTRY(lull_host),      ENTRY(lull_param),  ENTRY(lull_pair),   ENTRY(lull_requirements),
    ENTRY(lull_rect),     ENTRY(lull_frame),     ENTRY(lull_plane),  ENTRY(lull_block),  ENTRY(lull_view),
    ENTRY(lull_decision), ENTRY(lull_criterion), ENTRY(lull_writer), ENTRY(lull_reader), ENTRY(lull_state),
};
enum { LAYOUTS = sizeof layouts / sizeof *layouts };

static void print_layout(FILE *out)
{
    for (int i = 0; i < LAYOUTS; i++) {
        fprintf(out, "struct %s %zu\n", layouts[i].name, layouts[i].size);
        for (size_t k = 0; k < layouts[i].count; k++)
            fprintf(out, "  %zu %zu %s\n", layouts[i].fields[k].offset, layouts[i].fields[k].size,
                    layouts[i].fields[k].name);
    }
}

/* --- tests ----------------------------------------------------------------------------------------------------------- */

static void layout_is_the_frozen_one(void **state)
{
    (void)state;
    char *present = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&present, &size), *in = fopen("plugin-api/layout-1.txt", "r");
    assert_non_null(out);
    assert_non_null(in);
    print_layout(out);
    fclose(out);
    char line[200];
    const char *at = present;
    while (fgets(line, sizeof line, in)) {
        if (line[0] == '#')
            continue;
        size_t length = strcspn(at, "\n") + 1;
        char now[200];
        snprintf(now, sizeof now, "%.*s", (int)length, at);
        assert_string_equal(now, line);
        at += length;
    }
    assert_string_equal(at, "");
    fclose(in);
    free(present);
}

static void structs_have_no_padding(void **state)
{
    (void)state;
    for (int i = 0; i < LAYOUTS; i++) {
        size_t end = 0;
        for (size_t k = 0; k < layouts[i].count; k++) {
            if (layouts[i].fields[k].offset != end)
                fail_msg("%s.%s begins at %zu, not at %zu", layouts[i].name, layouts[i].fields[k].name,
                         layouts[i].fields[k].offset, end);
            end += layouts[i].fields[k].size;
        }
        assert_int_equal(end, layouts[i].size);
    }
}

static void growing_structs_begin_with_their_size(void **state)
{
    (void)state;
    static const char *const elements[] = {"lull_param", "lull_pair",  "lull_rect",
                                           "lull_plane", "lull_block", "lull_decision"};
    for (int i = 0; i < LAYOUTS; i++) {
        int is_element = 0;
        for (size_t k = 0; k < sizeof elements / sizeof *elements; k++)
            is_element |= strcmp(elements[k], layouts[i].name) == 0;
        assert_int_equal(strcmp(layouts[i].fields[0].name, "struct_size") == 0, !is_element);
    }
}

static void has_counts_whole_fields(void **state)
{
    (void)state;
    struct lull_view view = {.struct_size = offsetof(struct lull_view, elapsed_s)};
    assert_false(LULL_HAS(struct lull_view, &view, elapsed_s));
    assert_true(LULL_HAS(struct lull_view, &view, all_stride));
    view.struct_size += 7;
    assert_false(LULL_HAS(struct lull_view, &view, elapsed_s));
    view.struct_size += 1;
    assert_true(LULL_HAS(struct lull_view, &view, elapsed_s));
}

static void numbers_are_frozen(void **state)
{
    (void)state;
    const int32_t status[] = {LULL_OK,        LULL_E_INVALID,     LULL_E_KEY,       LULL_E_VALUE,
                              LULL_E_MEMORY,  LULL_E_PLANE,       LULL_E_STATE,     LULL_E_IO,
                              LULL_E_VERSION, LULL_E_UNSUPPORTED, LULL_E_CANCELLED, LULL_E_INTERNAL};
    for (size_t i = 0; i < sizeof status / sizeof *status; i++)
        assert_int_equal(status[i], -(int)i);
    const unsigned planes[] = {LULL_PLANE_COLOR, LULL_PLANE_WEIGHT, LULL_PLANE_SPP,    LULL_PLANE_MOMENT2,
                               LULL_PLANE_HALF,  LULL_PLANE_ALBEDO, LULL_PLANE_NORMAL, LULL_PLANE_DEPTH};
    assert_int_equal(sizeof planes / sizeof *planes, LULL_PLANE_COUNT);
    for (unsigned i = 0; i < LULL_PLANE_COUNT; i++) {
        assert_int_equal(planes[i], i);
        assert_int_equal(LULL_PLANE_BIT(i), 1u << i);
    }
    assert_int_equal(LULL_CONTINUE, 0);
    assert_int_equal(LULL_STOP, 1);
    const int32_t enums[][4] = {{LULL_TYPE_F32, LULL_TYPE_F16, LULL_TYPE_F64, LULL_TYPE_U32},
                                {LULL_NORM_ONE, LULL_NORM_SPP, LULL_NORM_HALF_SPP, LULL_NORM_WEIGHT},
                                {LULL_LOG_ERROR, LULL_LOG_WARNING, LULL_LOG_INFO, LULL_LOG_DEBUG},
                                {LULL_TRANSFER_UNKNOWN, LULL_TRANSFER_LINEAR, LULL_TRANSFER_SRGB, LULL_TRANSFER_GAMMA},
                                {LULL_THREADS_NONE, LULL_THREADS_INSTANCE, LULL_THREADS_FULL, 3},
                                {LULL_PARAM_INT, LULL_PARAM_FLOAT, LULL_PARAM_BOOL, LULL_PARAM_CHOICE}};
    for (size_t i = 0; i < sizeof enums / sizeof *enums; i++)
        for (int k = 0; k < 4; k++)
            assert_int_equal(enums[i][k], k);
    assert_int_equal(LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT | LULL_CAP_REOPENS, 7);
    assert_int_equal(LULL_FRAME_RESTART | LULL_FRAME_DETERMINISTIC | LULL_FRAME_INDEPENDENT | LULL_FRAME_SHARED, 15);
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "--print") == 0) {
        puts("# lull/criterion.h 1.0 where pointers have 8 bytes: each struct and its size, each field's offset and size.");
        puts("# Frozen: lines may be added (a minor version appends fields), never changed. Made by tests/abi/api_layout "
             "--print.");
        print_layout(stdout);
        return 0;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layout_is_the_frozen_one),
        cmocka_unit_test(structs_have_no_padding),
        cmocka_unit_test(growing_structs_begin_with_their_size),
        cmocka_unit_test(has_counts_whole_fields),
        cmocka_unit_test(numbers_are_frozen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
