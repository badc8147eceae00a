/* What a renderer can hand to the host library and makes no sense: every number and every pointer is refused by its name, and
 * nothing is done. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "support/api_host_film.h"

static char said[sizeof err.message]; /* when the last call was refused */

static void assert_refused(const char *what, int32_t code, int32_t expected, const char *words)
{
    snprintf(said, sizeof said, "%s", err.message);
    if (code != expected || err.code != expected || !strstr(err.message, words))
        fail_msg("%s: %d '%s' (expected %d '%s')", what, code, err.message, expected, words);
    err = (struct lull_error){.struct_size = sizeof err};
}

/* --- a config ----------------------------------------------------------------------------------------------------------- */

static void assert_config(int accepted, const char *name, double value)
{
    frame = NULL;
    int32_t code = lull_host_begin(&config, criterion, &frame, &err);
    if ((code == LULL_OK) != accepted || (frame != NULL) != accepted || (!accepted && !strstr(err.message, name)))
        fail_msg("%s %g: %d '%s'", name, value, code, err.message);
    lull_host_end(frame);
    frame = NULL;
}

static void every_number_of_a_config(void **state)
{
    (void)state;
    enum { ANY = 1, FROM_0 = 2, TO_1 = 4, FROM_1 = 8 }; /* finite numbers that are allowed beside 0 */
#define AT(field) #field, offsetof(struct lull_host_config, field)
    static const struct {
        const char *name;
        size_t at;
        int allowed;
    } fields[] = {{AT(gamma), FROM_0},         {AT(exposure), FROM_0},         {AT(sample_clamp), FROM_0},
                  {AT(time_budget_s), FROM_0}, {AT(max_check_overhead), TO_1}, {AT(max_seam), FROM_1},
                  {AT(rgb_to_xyz[0]), ANY},    {AT(rgb_to_xyz[5]), ANY},       {AT(rgb_to_xyz[8]), ANY}};
    const double values[] = {0, -0.0, 0.5, 1, 2, 1e300, -1, -1e300, (double)NAN, HUGE_VAL, -HUGE_VAL};
    set_up(ALL_PLANES, 0);
    const struct lull_host_config usual = config;
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++)
        for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
            const double v = values[i];
            config = usual;
            config.rgb_to_xyz[4] = 1e301; /* white is never black */
            *(double *)(void *)((char *)&config + fields[f].at) = v;
            const int above = (fields[f].allowed & FROM_0 && v >= 0) || (fields[f].allowed & TO_1 && v >= 0 && v <= 1) ||
                              (fields[f].allowed & FROM_1 && v >= 1) || fields[f].allowed & ANY;
            assert_config(isfinite(v) && (v == 0 || above), fields[f].name, v);
        }
    config = usual;
    config.rgb_to_xyz[3] = -1;
    assert_config(0, "rgb_to_xyz", -1);
    config = usual;
    for (int32_t transfer = -1; transfer < 100; transfer += transfer < 5 ? 1 : 94) {
        config.transfer = transfer;
        config.gamma = transfer == LULL_TRANSFER_GAMMA ? 2.2 : 0;
        assert_config(transfer >= 0 && transfer <= LULL_TRANSFER_GAMMA, "transfer", transfer);
    }
    config.transfer = LULL_TRANSFER_GAMMA;
    config.gamma = 0;
    assert_config(0, "gamma", 0);
    tear_down();
#undef AT
}

static void every_count_of_a_config(void **state)
{
    (void)state;
#define AT(field) #field, offsetof(struct lull_host_config, field), sizeof config.field
    static const struct {
        const char *name;
        size_t at, bytes;
        uint64_t value;
        const char *words;
    } rows[] = {{AT(struct_size), sizeof(struct lull_host_config) - 1, "config"},
                {AT(flags), LULL_FRAME_RESTART, "flags"},
                {AT(flags), 1u << 31, "flags"},
                {AT(width), 0, "picture of 0x14"},
                {AT(width), 1u << 31, "picture of 2147483648x14"},
                {AT(height), UINT32_MAX, "picture of 20x4294967295"},
                {AT(block_width), 1u << 31, "blocks of 2147483648x6"},
                {AT(block_height), UINT32_MAX, "blocks of 8x4294967295"},
                {AT(crop[0]), (uint32_t)-1, "crop -1,1,20,13"},
                {AT(crop[2]), INT32_MAX, "crop 9,1,2147483647,13"},
                {AT(crop[3]), 0, "crop 9,1,20,0"},
                {AT(planes), 1u << LULL_PLANE_COUNT, "planes"},
                {AT(planes), UINT32_MAX, "planes"},
                {AT(layout_count), 3, "layout is NULL"},
                {AT(spp_min), 0, "spp_min 0"},
                {AT(spp_min), UINT64_MAX, "spp_min 18446744073709551615"},
                {AT(spp_max), 2, "spp_max 2"},
                {AT(spp_max), UINT64_MAX, "spp_max 18446744073709551615"},
                {AT(spp_max), 1u << 31, "spp_max 2147483648"}};
    set_up(ALL_PLANES, 0);
    const struct lull_host_config usual = config;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        config = usual;
        memcpy((char *)&config + rows[i].at, &rows[i].value, rows[i].bytes); /* little endian, as all processors here */
        assert_config(0, rows[i].words, (double)rows[i].value);
    }
    config = usual;
    config.check_step = UINT64_MAX; /* one check, at the end */
    config.seed = UINT64_MAX;
    assert_config(1, "check_step", 0);
    config.width = config.height = INT32_MAX; /* more blocks than memory */
    memset(config.crop, 0, sizeof config.crop);
    config.block_width = config.block_height = 1;
    assert_config(0, "4611686014132420609 blocks are too many", 0);
    tear_down();
#undef AT
}

/* Disjoint rectangles in any order are taken, whatever they leave free; two that share a pixel are both named. */
static void layouts(void **state)
{
    (void)state;
    struct lull_rect rects[20 * 14];
    uint32_t n = 0;
    set_up(ALL_PLANES, 0);
    config.block_width = config.block_height = 0;
    config.layout = rects;
    config.layout_stride = sizeof rects[0];
    for (int32_t y = 13; y >= 0; y--)
        for (int32_t x = 0; x < 20; x++) /* columns out of order */
            rects[n++] = (struct lull_rect){x * 7 % 20, y, x * 7 % 20 + 1, y + 1};
    config.layout_count = n;
    assert_config(1, "layout", n);
    rects[0] = (struct lull_rect){3, 2, 4, 3};
    assert_config(0, "blocks 0 (3,2,4,3) and 229 (3,2,4,3) overlap", 0);
    static const struct lull_rect pairs[][2] = {{{0, 0, 10, 10}, {9, 9, 12, 12}}, {{0, 0, 10, 10}, {2, 3, 4, 5}},
                                                {{5, 0, 6, 14}, {0, 6, 20, 7}},   {{4, 4, 8, 8}, {2, 2, 5, 5}},
                                                {{2, 2, 9, 9}, {2, 2, 9, 9}},     {{4, 4, 8, 8}, {7, 0, 9, 5}}};
    config.layout_count = 3;
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++)
        for (int turned = 0; turned < 2; turned++) {
            rects[0] = pairs[i][turned];
            rects[1] = (struct lull_rect){19, 13, 20, 14};
            rects[2] = pairs[i][!turned];
            assert_config(0, "overlap", (double)i);
        }
    rects[2] = rects[1];
    rects[1].x0 = -1;
    assert_config(0, "block 1 (-1,13,20,14)", 0);
    config.layout_stride = sizeof rects[0] + 1;
    assert_config(0, "layout", 0);
    config.layout_stride = 8;
    assert_config(0, "layout", 0);
    config.layout_count = UINT32_MAX;
    config.layout_stride = sizeof rects[0];
    assert_config(0, "4294967295 blocks are too many", 0);
    tear_down();
}

/* --- services and parameters -------------------------------------------------------------------------------------------- */

static void pairs_and_services(void **state)
{
    (void)state;
    static const struct lull_pair no_key[2] = {{"threshold", "1"}, {NULL, "1"}}, no_value[1] = {{"visible", NULL}};
    struct lull_host_services s = {.struct_size = sizeof s, .threads = UINT32_MAX};
    struct lull_host_criterion *made = NULL;
    const char *build = getenv("BUILD"); /* as tests/run sets it */
    char null[256];
    snprintf(null, sizeof null, "%s/lib/lull/null.so", build ? build : "build");
    err = (struct lull_error){.struct_size = sizeof err};
    for (int open = 0; open < 2; open++) {
#define MAKE(services, pairs, count, out) \
    (open ? lull_host_open(services, null, pairs, count, out, &err) \
          : lull_host_create(services, &table, pairs, count, out, &err))
        assert_refused("key", MAKE(NULL, no_key, 2, &made), LULL_E_KEY, "pairs[1]: key is NULL");
        assert_refused("value", MAKE(NULL, no_value, 1, &made), LULL_E_VALUE, "pairs[0]: the value of 'visible' is NULL");
        assert_refused("pairs", MAKE(NULL, NULL, 2, &made), LULL_E_INVALID, "pairs is NULL");
        assert_refused("out", MAKE(NULL, NULL, 0, NULL), LULL_E_INVALID, "out is NULL");
        assert_refused("threads", MAKE(&s, NULL, 0, &made), LULL_E_INVALID, "4294967295 threads");
        s.struct_size--;
        assert_refused("size", MAKE(&s, NULL, 0, &made), LULL_E_VERSION, "services");
        s.struct_size++;
#undef MAKE
    }
    assert_refused("table", lull_host_create(NULL, NULL, NULL, 0, &made, &err), LULL_E_INVALID, "table is NULL");
    assert_refused("spec", lull_host_open(NULL, NULL, NULL, 0, &made, &err), LULL_E_INVALID, "NAME");
    assert_null(made);
}

/* --- a view, a mask ----------------------------------------------------------------------------------------------------- */

static void type(struct lull_plane *p) { p->type = 4; }
static void type_below(struct lull_plane *p) { p->type = -1; }
static void normaliser(struct lull_plane *p) { p->normaliser = 4; }
static void channels(struct lull_plane *p) { p->channels = 0; }
static void scale(struct lull_plane *p) { p->scale = 0; }
static void scale_nan(struct lull_plane *p) { p->scale = (double)NAN; }
static void scale_inf(struct lull_plane *p) { p->scale = HUGE_VAL; }
static void stride_x(struct lull_plane *p) { p->stride_x += 1; }
static void stride_y(struct lull_plane *p) { p->stride_y -= 2; }
static void data(struct lull_plane *p) { p->data = (const char *)p->data + 1; }

static const struct {
    const char *what;
    void (*damage)(struct lull_plane *p);
} damages[] = {{"type", type},         {"type", type_below}, {"normaliser", normaliser}, {"channels", channels},
               {"scale", scale},       {"scale", scale_nan}, {"scale", scale_inf},       {"stride_x", stride_x},
               {"stride_y", stride_y}, {"data", data}};

static void every_field_of_a_plane(void **state)
{
    (void)state;
    static const uint32_t due[1] = {1};
    struct lull_decision got[1];
    static double grey[20 * 14];
    for (size_t i = 0; i < sizeof damages / sizeof damages[0]; i++) {
        set_up(ALL_PLANES, 0);
        begin();
        damages[i].damage(&planes[LULL_PLANE_HALF]);
        assert_refused(damages[i].what, lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_E_PLANE,
                       damages[i].what);
        assert_true(got[0].action == LULL_CONTINUE);
        tear_down();
    }
    for (size_t i = 0; i < sizeof damages / sizeof damages[0]; i++) {
        struct lull_plane mask = {
            .data = grey, .stride_x = 8, .stride_y = 160, .scale = 1, .type = LULL_TYPE_F64, .channels = 1};
        const struct lull_pair pair = {"threshold", "2"};
        set_up(ALL_PLANES, 0);
        lull_host_close(criterion);
        assert_int_equal(lull_host_create(&services, &table, &pair, 1, &criterion, &err), LULL_OK);
        damages[i].damage(&mask);
        config.mask = &mask;
        assert_config(0, "the mask", (double)i);
        tear_down();
    }
}

static void views(void **state)
{
    (void)state;
    static const uint32_t due[2] = {1, 2}, falling[2] = {2, 1}, beyond[1] = {6};
    struct lull_decision got[2];
    set_up(ALL_PLANES, 0);
    struct lull_host_block *list = begin();
#define ASK(v, due, n) lull_host_evaluate(criterion, frame, v, due, NULL, n, got, &err)
    assert_refused("view", ASK(NULL, due, 2), LULL_E_INVALID, "view is NULL");
    assert_refused("due", ASK(&view, NULL, 2), LULL_E_INVALID, "due is NULL");
    assert_refused("due", ASK(&view, falling, 2), LULL_E_INVALID, "due[1] is 1");
    assert_refused("due", ASK(&view, beyond, 1), LULL_E_INVALID, "due[0] is 6");
    assert_refused("decisions", lull_host_evaluate(criterion, frame, &view, due, NULL, 2, NULL, &err), LULL_E_INVALID,
                   "decisions is NULL");
    assert_refused("criterion", lull_host_evaluate(NULL, frame, &view, due, NULL, 2, got, &err), LULL_E_INVALID,
                   "criterion");
    assert_refused("frame", lull_host_evaluate(criterion, NULL, &view, due, NULL, 2, got, &err), LULL_E_INVALID, "frame");
    struct lull_host_view v = view;
    v.planes = NULL;
    assert_refused("planes", ASK(&v, due, 2), LULL_E_INVALID, "planes is NULL");
    v = view;
    v.plane_count = LULL_PLANE_NORMAL; /* and the config says that there is one */
    assert_refused("planes", ASK(&v, due, 2), LULL_E_PLANE, "NORMAL");
    v = view;
    v.x0 = INT32_MIN;
    v.x1 = INT32_MAX;
    assert_refused("size", ASK(&v, due, 2), LULL_E_INVALID, "too large");
    v = view;
    v.struct_size = 8;
    assert_refused("size", ASK(&v, due, 2), LULL_E_VERSION, "view");
    lost_plane.data = NULL;
    list[1].dropped = 1;
    assert_refused("dropped", ASK(&view, due, 2), LULL_E_PLANE, "dropped");
#undef ASK
    tear_down();
}

/* --- what the renderer writes ------------------------------------------------------------------------------------------- */

static void every_number_of_a_block(void **state)
{
    (void)state;
    const struct {
        const char *words;
        struct lull_host_block b;
        int accepted;
    } rows[] = {{"half_spp 11", {.spp = 10, .half_spp = 11}, 0},
                {"half_spp 18446744073709551615", {.spp = 10, .half_spp = UINT64_MAX}, 0},
                {"spp 18446744073709551615", {.spp = UINT64_MAX}, 0},
                {"spp is 0", {.spp = 0}, 0},
                {"spp fell from 12 to 10", {.spp = 10, .half_spp = 5, .asked = 1, .asked_spp = 12}, 0},
                {"thread_s -1", {.spp = 10, .half_spp = 5, .thread_s = -1}, 0},
                {"thread_s inf", {.spp = 10, .half_spp = 5, .thread_s = HUGE_VAL}, 0},
                {"dropped 481", {.spp = 10, .half_spp = 5, .dropped = 481}, 0},
                {"", {.spp = 10, .half_spp = 5, .dropped = 480}, 1},
                {"", {.spp = 10, .half_spp = 5, .thread_s = (double)NAN}, 1}}; /* not known */
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        set_up(ALL_PLANES, 0);
        struct lull_host_block *b = begin() + 2, before = *b;
        b->spp = rows[i].b.spp;
        b->half_spp = rows[i].b.half_spp;
        b->thread_s = rows[i].b.thread_s;
        b->dropped = rows[i].b.dropped;
        b->asked = rows[i].b.asked;
        b->asked_spp = rows[i].b.asked_spp;
        if (rows[i].accepted)
            assert_int_equal(lull_host_check(frame, &view, &err), LULL_OK);
        else {
            assert_refused(rows[i].words, lull_host_check(frame, &view, &err), LULL_E_INVALID, rows[i].words);
            assert_true(strncmp(said, "block 2: ", 9) == 0);
            assert_true(b->next_spp == before.next_spp && b->checks == 0 && lull_host_totals_of(frame)->checks == 0);
        }
        tear_down();
    }
    set_up(ALL_PLANES, 0);
    begin();
    for (int i = 0; i < 3; i++) {
        lull_host_totals_of(frame)->render_s = i == 0 ? (double)NAN : i == 1 ? -1 : HUGE_VAL;
        assert_refused("render_s", lull_host_check(frame, &view, &err), LULL_E_INVALID, "render_s");
    }
    for (int32_t reason = -1; reason < 100; reason += reason < 0 ? 1 : LULL_REASON_COUNT)
        assert_refused("reason", lull_host_stop(frame, reason, NULL, &err), LULL_E_INVALID, "reason");
    assert_int_equal(lull_host_active(lull_host_blocks_of(frame)), 6);
    const double seams[] = {(double)NAN, 0, -1, 0.5};
    lull_host_blocks_of(frame)->list[0].reason = LULL_REASON_CRITERION;
    for (size_t i = 0; i < 4; i++)
        assert_int_equal(lull_host_reopen(lull_host_blocks_of(frame), seams[i]), 0);
    assert_int_equal(lull_host_next_check(lull_host_blocks_of(frame), UINT64_MAX, UINT64_MAX), 90);
    tear_down();
}

/* --- pointers ----------------------------------------------------------------------------------------------------------- */

static void every_pointer(void **state)
{
    (void)state;
    struct lull_host_frame *none = NULL;
    struct lull_host_quote *quote = NULL;
    struct lull_host_display *display = NULL;
    struct lull_host_file *file = NULL;
    struct lull_host_forecast forecast;
    const struct lull_host_quote_row *rows;
    struct lull_host_report report = {.struct_size = sizeof report, .effect_count = 1};
    struct lull_host_denoising how = {.struct_size = sizeof how};
    struct lull_host_picture out = {.struct_size = sizeof out};
    struct lull_writer writer = {.struct_size = sizeof writer};
    struct lull_pair pair = {"threshold", NULL};
    const struct lull_host_layer layer = {"picture", NULL};
    int32_t descriptor;
    uint32_t count;
    set_up(ALL_PLANES, 0);
    begin();
    struct lull_host_blocks *b = lull_host_blocks_of(frame);
    double values[6] = {0, 0, (double)NAN};
#define NO(name, call) assert_refused(#call, call, LULL_E_INVALID, name)
    NO("config", lull_host_begin(NULL, criterion, &none, &err));
    NO("out", lull_host_begin(&config, criterion, NULL, &err));
    NO("frame", lull_host_join(NULL, criterion, &err));
    NO("criterion", lull_host_join(frame, NULL, &err));
    NO("frame", lull_host_check(NULL, &view, &err));
    NO("frame", lull_host_stop(NULL, LULL_REASON_TIME, NULL, &err));
    NO("frame", lull_host_ask(NULL, &view, NULL, NULL, 0, NULL, &err));
    NO("blocks", lull_host_forecast_of(NULL, lull_host_totals_of(frame), 1, &forecast, &err));
    NO("totals", lull_host_forecast_of(b, NULL, 1, &forecast, &err));
    NO("0 threads", lull_host_forecast_of(b, lull_host_totals_of(frame), 0, &forecast, &err));
    NO("out", lull_host_forecast_of(b, lull_host_totals_of(frame), 1, NULL, &err));
    NO("frame", lull_host_quote_begin(NULL, 1, &quote, &err));
    NO("-1 threads", lull_host_quote_begin(frame, -1, &quote, &err));
    NO("out", lull_host_quote_begin(frame, 1, NULL, &err));
    NO("quote", lull_host_quote_add(NULL, NULL, 0, &err));
    NO("quote", lull_host_quote_add_other(NULL, NULL, &err));
    NO("quote", lull_host_quote_finish(NULL, &view, &rows, &count, &err));
    assert_int_equal(lull_host_quote_begin(frame, 1, &quote, &err), LULL_OK);
    assert_refused("value", lull_host_quote_add(quote, &pair, 0, &err), LULL_E_VALUE, "threshold");
    NO("criterion", lull_host_quote_add_other(quote, NULL, &err));
    NO("view", lull_host_quote_finish(quote, NULL, &rows, &count, &err));
    NO("rows", lull_host_quote_finish(quote, &view, NULL, &count, &err));
    lull_host_quote_end(quote);
    NO("effects", lull_host_report_write(frame, &report, "r.json", &err));
    report.effect_count = 0;
    report.command_count = 2;
    NO("command", lull_host_report_write(frame, &report, "r.json", &err));
    report.command_count = 0;
    report.phase_count = 1;
    NO("phases", lull_host_report_write(frame, &report, "r.json", &err));
    report.phases = &(struct lull_host_phase){.seconds = 1.0};
    NO("name", lull_host_report_write(frame, &report, "r.json", &err));
    report.phase_count = 0;
    NO("path", lull_host_report_write(frame, &report, NULL, &err));
    NO("report", lull_host_report_write(frame, NULL, "r.json", &err));
    NO("frame", lull_host_report_text(NULL, &report, &writer, &err));
    NO("writer", lull_host_report_text(frame, &report, NULL, &err));
    NO("write", lull_host_report_text(frame, &report, &writer, &err));
    NO("report", lull_host_page(NULL, NULL, NULL, 0, 1, 1, "page.html", &err));
    NO("rgb", lull_host_page("{}", NULL, &layer, 1, 1, 1, "page.html", &err));
    NO("layers", lull_host_page("{}", NULL, NULL, 1, 1, 1, "page.html", &err));
    NO("path", lull_host_page("{}", NULL, NULL, 0, 1, 1, NULL, &err));
    NO("no picture has this size",
       lull_host_page("{\"width\": -1, \"height\": 4, \"blocks\": []}", NULL, NULL, 0, 1, 1, "page.html", &err));
    NO("blocks", lull_host_stop_map(NULL, "m.png", "s", &err));
    NO("path", lull_host_stop_map(b, NULL, "s", &err));
    NO("scene", lull_host_stop_map(b, "m.csv", NULL, &err));
    NO("values[2] nan", lull_host_value_map(b, values, "u", "m.png", &err));
    NO("values", lull_host_value_map(b, NULL, "u", "m.png", &err));
    NO("unit", lull_host_value_map(b, values, NULL, "m.png", &err));
    NO("how", lull_host_denoise(frame, &view, NULL, &out, &err));
    NO("rgb", lull_host_denoise(frame, &view, &how, &out, &err));
    NO("address", lull_host_display_open(frame, NULL, "n", &display, &err));
    NO("name", lull_host_display_open(frame, "localhost", NULL, &display, &err));
    NO("display", lull_host_display_update(NULL, &view, &err));
    NO("outputs", lull_host_check_outputs(NULL, 1, NULL, 0, &err));
    NO("inputs", lull_host_check_outputs(NULL, 0, NULL, 1, &err));
    NO("path", lull_host_file_begin(NULL, &file, &descriptor, &err));
    NO("file", lull_host_file_commit(NULL, &err));
    NO("rgb", lull_host_write_png("m.png", 1, 1, NULL, &err));
    NO("0x1", lull_host_write_png("m.png", 0, 1, (const uint8_t *)"", &err));
    NO("writer", lull_host_save(frame, NULL, &err));
    NO("write", lull_host_save(frame, &writer, &err));
    NO("criterion", lull_host_save_history(NULL, &writer, &err));
    NO("data", lull_host_load(frame, NULL, 8, "state", &err));
    NO("name", lull_host_load(frame, "", 0, NULL, &err));
    NO("saved", lull_host_same_identity(NULL, 0, "", "state", &err));
    NO("present", lull_host_same_identity("", 0, NULL, "state", &err));
#undef NO
    lull_host_file_abort(NULL);
    assert_null(lull_host_table(NULL));
    assert_null(lull_host_needs(NULL));
    assert_null(lull_host_blocks_of(NULL));
    assert_null(lull_host_totals_of(NULL));
    assert_int_equal(lull_host_active(NULL), 0);
    assert_true(!none && !display && !file);
    tear_down();
}

/* --- warnings without a log --------------------------------------------------------------------------------------------- */

/* half_spp is forgotten: nothing stops, and the renderer hears of it once, through its log or, without one, through err. */
static void forgotten_halves(void **state)
{
    (void)state;
    for (int log = 0; log < 2; log++) {
        set_up(ALL_PLANES, LULL_PLANE_BIT(LULL_PLANE_HALF));
        if (!log) {
            lull_host_close(criterion);
            assert_int_equal(lull_host_create(NULL, &table, NULL, 0, &criterion, &err), LULL_OK);
        }
        struct lull_host_block *list = begin();
        warned[0] = '\0';
        for (int check = 0; check < 3; check++) {
            for (int i = 0; i < 6; i++) {
                list[i].spp = list[i].next_spp < 20 ? 20 : list[i].next_spp;
                list[i].half_spp = 0;
            }
            err = (struct lull_error){.struct_size = sizeof err, .code = 1};
            assert_int_equal(lull_host_check(frame, &view, &err), LULL_OK);
            const char *heard_in_log = warned[0] ? warned : "", *heard_in_err = err.message;
            assert_true((strstr(heard_in_log, "1: criterion logger: half_spp is 0") != NULL) == (log && check == 0));
            assert_true((strstr(heard_in_err, "criterion logger: half_spp is 0") != NULL) == (!log && check == 0));
            assert_int_equal(err.code, !log && check == 0 ? LULL_OK : 1); /* else untouched */
            warned[0] = '\0';
        }
        if (log)
            tear_down();
        else {
            lull_host_end(frame);
            frame = NULL;
            lull_host_close(criterion);
        }
    }
    set_up(ALL_PLANES, LULL_PLANE_BIT(LULL_PLANE_HALF)); /* one block with both halves is enough */
    begin()[3].half_spp = 5;
    warned[0] = '\0';
    assert_int_equal(lull_host_check(frame, &view, &err), LULL_OK);
    assert_string_equal(warned, "");
    tear_down();
}

/* Any other warning of a criterion, too; the first one, and never what is only information. */
static void warnings_without_a_log(void **state)
{
    (void)state;
    static const uint32_t due[1] = {0};
    struct lull_decision got[1];
    set_up(ALL_PLANES, 0);
    lull_host_close(criterion);
    assert_int_equal(lull_host_create(NULL, &table, NULL, 0, &criterion, &err), LULL_OK);
    begin();
    const struct lull_host *host = criterion->instances[0]->host;
    host->log(host, LULL_LOG_INFO, "chatter");
    host->log(host, LULL_LOG_WARNING, "the first");
    host->log(host, LULL_LOG_ERROR, "the second");
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, NULL), LULL_OK); /* nobody listens */
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
    assert_string_equal(err.message, "criterion logger: the first");
    err.message[0] = '\0';
    assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
    assert_string_equal(err.message, "");
    lull_host_end(frame);
    frame = NULL;
    lull_host_close(criterion);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_number_of_a_config),
        cmocka_unit_test(every_count_of_a_config),
        cmocka_unit_test(layouts),
        cmocka_unit_test(pairs_and_services),
        cmocka_unit_test(every_field_of_a_plane),
        cmocka_unit_test(views),
        cmocka_unit_test(every_number_of_a_block),
        cmocka_unit_test(every_pointer),
        cmocka_unit_test(forgotten_halves),
        cmocka_unit_test(warnings_without_a_log),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
