/*
 * The layouts of the ABI and of the host library, field by field, against the frozen plugin-api/layout-1.txt and
 * plugin-api/host-layout-1.txt. Run from the root of the source tree; `api_layout --print` and --print-host print the present ones
 * instead.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <lull/host_draft.h>

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

#define F(T, field) \
    { \
#field, offsetof(struct T, field), sizeof(((struct T *)0)->field) \
    }
#define LAYOUT(T, ...) static const struct field T##_fields[] = {__VA_ARGS__}
#define ENTRY(T) \
    { \
#T, sizeof(struct T), T##_fields, sizeof T##_fields / sizeof *T##_fields \
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

LAYOUT(lull_host_services, F(lull_host_services, struct_size), F(lull_host_services, threads), F(lull_host_services, name),
       F(lull_host_services, context), F(lull_host_services, log), F(lull_host_services, parallel_for),
       F(lull_host_services, release));
LAYOUT(lull_host_config, F(lull_host_config, struct_size), F(lull_host_config, flags), F(lull_host_config, width),
       F(lull_host_config, height), F(lull_host_config, block_width), F(lull_host_config, block_height),
       F(lull_host_config, crop), F(lull_host_config, layout), F(lull_host_config, layout_count),
       F(lull_host_config, layout_stride), F(lull_host_config, planes), F(lull_host_config, transfer),
       F(lull_host_config, gamma), F(lull_host_config, exposure), F(lull_host_config, sample_clamp),
       F(lull_host_config, rgb_to_xyz), F(lull_host_config, spp_min), F(lull_host_config, spp_max),
       F(lull_host_config, seed), F(lull_host_config, time_budget_s), F(lull_host_config, max_check_overhead),
       F(lull_host_config, max_seam), F(lull_host_config, check_step), F(lull_host_config, mask));
LAYOUT(lull_host_block, F(lull_host_block, id), F(lull_host_block, x0), F(lull_host_block, y0), F(lull_host_block, x1),
       F(lull_host_block, y1), F(lull_host_block, reason), F(lull_host_block, spp), F(lull_host_block, half_spp),
       F(lull_host_block, thread_s), F(lull_host_block, rays), F(lull_host_block, dropped), F(lull_host_block, next_spp),
       F(lull_host_block, asked_spp), F(lull_host_block, p_noisy), F(lull_host_block, error),
       F(lull_host_block, predicted_spp), F(lull_host_block, asked), F(lull_host_block, checks),
       F(lull_host_block, stop_votes), F(lull_host_block, step));
LAYOUT(lull_host_blocks, F(lull_host_blocks, struct_size), F(lull_host_blocks, count), F(lull_host_blocks, list),
       F(lull_host_blocks, columns), F(lull_host_blocks, rows), F(lull_host_blocks, list_columns),
       F(lull_host_blocks, flags), F(lull_host_blocks, block_width), F(lull_host_blocks, block_height),
       F(lull_host_blocks, x0), F(lull_host_blocks, y0), F(lull_host_blocks, x1), F(lull_host_blocks, y1),
       F(lull_host_blocks, spp_min), F(lull_host_blocks, spp_max), F(lull_host_blocks, check_step));
LAYOUT(lull_host_totals, F(lull_host_totals, samples), F(lull_host_totals, paths), F(lull_host_totals, rays),
       F(lull_host_totals, dropped), F(lull_host_totals, render_s), F(lull_host_totals, criterion_s),
       F(lull_host_totals, checks), F(lull_host_totals, failed_checks), F(lull_host_totals, skipped_checks),
       F(lull_host_totals, criterion_thread_s), F(lull_host_totals, asked));
LAYOUT(lull_host_view, F(lull_host_view, struct_size), F(lull_host_view, plane_count), F(lull_host_view, x0),
       F(lull_host_view, y0), F(lull_host_view, x1), F(lull_host_view, y1), F(lull_host_view, planes),
       F(lull_host_view, dropped), F(lull_host_view, dropped_half));
LAYOUT(lull_host_stop_at, F(lull_host_stop_at, spp), F(lull_host_stop_at, low), F(lull_host_stop_at, high),
       F(lull_host_stop_at, known));
LAYOUT(lull_host_forecast, F(lull_host_forecast, done_s), F(lull_host_forecast, left_s), F(lull_host_forecast, sampling_s),
       F(lull_host_forecast, check_s), F(lull_host_forecast, low), F(lull_host_forecast, high),
       F(lull_host_forecast, active), F(lull_host_forecast, known));
LAYOUT(lull_host_sample, F(lull_host_sample, x), F(lull_host_sample, y), F(lull_host_sample, sample));
LAYOUT(lull_host_report, F(lull_host_report, struct_size), F(lull_host_report, flags), F(lull_host_report, scene),
       F(lull_host_report, mask), F(lull_host_report, kernel), F(lull_host_report, effects),
       F(lull_host_report, effect_count), F(lull_host_report, threads), F(lull_host_report, processes),
       F(lull_host_report, zero), F(lull_host_report, messages), F(lull_host_report, message_bytes),
       F(lull_host_report, message_wait_s), F(lull_host_report, film_bytes), F(lull_host_report, film_pixels),
       F(lull_host_report, scene_bytes), F(lull_host_report, noisy_weight), F(lull_host_report, noisy_error),
       F(lull_host_report, software), F(lull_host_report, processor), F(lull_host_report, command),
       F(lull_host_report, command_count), F(lull_host_report, phases), F(lull_host_report, phase_count));
LAYOUT(lull_host_phase, F(lull_host_phase, name), F(lull_host_phase, seconds));
LAYOUT(lull_host_simulation, F(lull_host_simulation, struct_size), F(lull_host_simulation, zero),
       F(lull_host_simulation, pixels), F(lull_host_simulation, spp), F(lull_host_simulation, half_spp),
       F(lull_host_simulation, to_spp), F(lull_host_simulation, rgb_to_xyz), F(lull_host_simulation, color),
       F(lull_host_simulation, half), F(lull_host_simulation, moment2));
LAYOUT(lull_host_layer, F(lull_host_layer, name), F(lull_host_layer, rgb));
LAYOUT(lull_host_denoising, F(lull_host_denoising, struct_size), F(lull_host_denoising, flags),
       F(lull_host_denoising, threads), F(lull_host_denoising, zero), F(lull_host_denoising, library),
       F(lull_host_denoising, context), F(lull_host_denoising, cancelled));
LAYOUT(lull_host_picture, F(lull_host_picture, struct_size), F(lull_host_picture, zero), F(lull_host_picture, rgb),
       F(lull_host_picture, denoised), F(lull_host_picture, weight));
LAYOUT(lull_host_output, F(lull_host_output, option), F(lull_host_output, path));
LAYOUT(lull_host_quote_block, F(lull_host_quote_block, stop), F(lull_host_quote_block, thread_s),
       F(lull_host_quote_block, thread_low_s), F(lull_host_quote_block, thread_high_s), F(lull_host_quote_block, sample_s),
       F(lull_host_quote_block, unmet));
LAYOUT(lull_host_quote_row, F(lull_host_quote_row, blocks), F(lull_host_quote_row, spp_min),
       F(lull_host_quote_row, spp_mean), F(lull_host_quote_row, spp_max), F(lull_host_quote_row, spp_mean_low),
       F(lull_host_quote_row, spp_mean_high), F(lull_host_quote_row, thread_s), F(lull_host_quote_row, thread_low_s),
       F(lull_host_quote_row, thread_high_s), F(lull_host_quote_row, wall_s), F(lull_host_quote_row, wall_low_s),
       F(lull_host_quote_row, wall_high_s), F(lull_host_quote_row, against_uniform), F(lull_host_quote_row, unknown),
       F(lull_host_quote_row, unmet), F(lull_host_quote_row, capped), F(lull_host_quote_row, asked),
       F(lull_host_quote_row, parameter), F(lull_host_quote_row, value), F(lull_host_quote_row, name),
       F(lull_host_quote_row, told));

/* The criterion's, then the host library's. */
static const struct layout layouts[] = {
    ENTRY(lull_error),          ENTRY(lull_host),           ENTRY(lull_param),
    ENTRY(lull_pair),           ENTRY(lull_requirements),   ENTRY(lull_rect),
    ENTRY(lull_frame),          ENTRY(lull_plane),          ENTRY(lull_block),
    ENTRY(lull_view),           ENTRY(lull_decision),       ENTRY(lull_criterion),
    ENTRY(lull_writer),         ENTRY(lull_reader),         ENTRY(lull_state),
    ENTRY(lull_host_services),  ENTRY(lull_host_config),    ENTRY(lull_host_block),
    ENTRY(lull_host_blocks),    ENTRY(lull_host_totals),    ENTRY(lull_host_view),
    ENTRY(lull_host_stop_at),   ENTRY(lull_host_forecast),  ENTRY(lull_host_sample),
    ENTRY(lull_host_report),    ENTRY(lull_host_denoising), ENTRY(lull_host_layer),
    ENTRY(lull_host_picture),   ENTRY(lull_host_output),    ENTRY(lull_host_quote_block),
    ENTRY(lull_host_quote_row), ENTRY(lull_host_phase),     ENTRY(lull_host_simulation),
};
enum { LAYOUTS = sizeof layouts / sizeof *layouts, OF_THE_ABI = 15 };

static void print_layout(FILE *out, int from, int to)
{
    for (int i = from; i < to; i++) {
        fprintf(out, "struct %s %zu\n", layouts[i].name, layouts[i].size);
        for (size_t k = 0; k < layouts[i].count; k++)
            fprintf(out, "  %zu %zu %s\n", layouts[i].fields[k].offset, layouts[i].fields[k].size,
                    layouts[i].fields[k].name);
    }
}

/* --- tests ----------------------------------------------------------------------------------------------------------- */

static void compare_layout(const char *path, int from, int to)
{
    char *present = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&present, &size), *in = fopen(path, "r");
    assert_non_null(out);
    assert_non_null(in);
    print_layout(out, from, to);
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

static void layout_is_the_frozen_one(void **state)
{
    (void)state;
    compare_layout("plugin-api/layout-1.txt", 0, OF_THE_ABI);
    compare_layout("plugin-api/host-layout-1.txt", OF_THE_ABI, LAYOUTS);
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
    static const char *const elements[] = {"lull_param",          "lull_pair",
                                           "lull_rect",           "lull_plane",
                                           "lull_block",          "lull_decision",
                                           "lull_host_block",     "lull_host_totals",
                                           "lull_host_stop_at",   "lull_host_forecast",
                                           "lull_host_sample",    "lull_host_phase",
                                           "lull_host_output",    "lull_host_quote_block",
                                           "lull_host_quote_row", "lull_host_layer"};
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
    const int32_t reasons[] = {LULL_REASON_NONE, LULL_REASON_CRITERION, LULL_REASON_SPP_MAX, LULL_REASON_UNIFORM,
                               LULL_REASON_TIME, LULL_REASON_INTERRUPT, LULL_REASON_DROPPED, LULL_REASON_COUNT};
    for (int i = 0; i <= LULL_REASON_COUNT; i++)
        assert_int_equal(reasons[i], i);
    assert_int_equal(LULL_HOST_UNIFORM | LULL_HOST_HALF_KNOWN, 0x300);
    assert_int_equal(LULL_REPORT_INTERRUPTED | LULL_REPORT_MESSAGES | LULL_REPORT_NO_RAYS, 7);
    assert_int_equal(LULL_HOST_DROPPED_KEPT, 16);
}

int main(int argc, char **argv)
{
    const int host = argc > 1 && strcmp(argv[1], "--print-host") == 0;
    if (host || (argc > 1 && strcmp(argv[1], "--print") == 0)) {
        printf("# lull/%s where pointers have 8 bytes: each struct and its size, each field's offset and size.\n"
               "# Frozen: lines may be added (a minor version appends fields), never changed. Made by tests/abi/api_layout "
               "%s.\n",
               host ? "host.h" : "criterion.h", argv[1]);
        print_layout(stdout, host ? OF_THE_ABI : 0, host ? LAYOUTS : OF_THE_ABI);
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
