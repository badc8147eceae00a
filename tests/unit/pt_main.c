/* The program lull-render: its command line, what is opened for it, the words of a quote, what goes on beside a render. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "app/actions.h"
#include "app/agree.h"
#include "app/quote_output.h"
#include "app/watch.h"
#include "base/clock.h"
#include "base/files.h"
#include "base/interrupt.h"
#include "host/frame.h"
#include "integ/integrator.h"
#include "picture/png.h"
#include "picture/read.h"
#include "render/output.h"
#include "support/api_folders.h"
#include "support/approve.h"
#include "support/pt_fake.h"
#include "support/pt_captured.h"
#include "support/pt_text_scene.h"

/* --- command lines ------------------------------------------------------------------------------------------------------ */

static void print_text(FILE *out, const char *name, const char *text)
{
    if (text)
        fprintf(out, "%s=%s ", name, text);
}

/* A number that is not what it is without options. */
static void print_number(FILE *out, const char *name, double value, double usual)
{
    if (value != usual)
        fprintf(out, "%s=%.17g ", name, value);
}

static void print_several(FILE *out, const struct pt_cli *c)
{
    if (c->has_crop)
        fprintf(out, "crop=%d,%d,%d,%d ", c->render.crop[0], c->render.crop[1], c->render.crop[2], c->render.crop[3]);
    for (int i = 0; c->load.view.has_look_at && i < 9; i++)
        fprintf(out, "%s%g", i ? "," : "look-at=", c->load.view.look_at_world[i]);
    for (uint32_t i = 0; i < c->params.count; i++)
        fprintf(out, "param %s is %s; ", c->params.list[i].key, c->params.list[i].value);
    for (int i = PT_STOP_MAPS; i < PT_PATHS; i++)
        print_text(out, "stop-map", c->paths[i]);
    if (c->action == PT_CLI_DEBUG_PATH)
        fprintf(out, "debug=%d,%d,%d ", c->debug[0], c->debug[1], c->debug[2]);
}

static void print_cli(FILE *out, const struct pt_cli *c)
{
    static const char *const actions[] = {"render", "list", "explain", "debug", "sequence", "quote"};
    const struct {
        const char *name, *text;
    } texts[] = {{"criterion", c->criterion},     {"mask", c->mask},
                 {"output", c->paths[PT_OUTPUT]}, {"preview", c->paths[PT_PREVIEW]},
                 {"report", c->paths[PT_REPORT]}, {"checkpoint", c->paths[PT_CHECKPOINT]},
                 {"quote-map", c->quote_map},     {"sequence", c->sequence.directory},
                 {"levels", c->sequence.levels},  {"blocks", c->sequence.blocks},
                 {"name", c->sequence.name}};
    const struct {
        const char *name;
        double value, usual;
    } numbers[] = {{"block", c->render.block_width, 200},
                   {"by", c->render.block_height, 200},
                   {"spp-min", c->render.uniform ? 16 : (double)c->render.spp_min, 16},
                   {"spp-max", c->render.uniform ? 10000 : (double)c->render.spp_max, 10000},
                   {"spp", (double)c->spp, 0},
                   {"budget", c->render.time_budget_s, 0},
                   {"overhead", c->render.max_check_overhead, 0},
                   {"seam", c->render.max_seam, 0},
                   {"width", c->load.width, 0},
                   {"height", c->load.height, 0},
                   {"fov", c->load.view.fov_deg, 0},
                   {"threads", c->threads, 0},
                   {"rank-timeout", c->rank_timeout_s, 120},
                   {"seed", c->render.integrator.seed, 0},
                   {"every", c->checkpoint_every_s, 60},
                   {"resume", c->resume, 0},
                   {"quote", c->quote, 0},
                   {"pilot-spp", (double)c->render.pilot_spp, 0},
                   {"pilot-s", c->render.pilot_s, 0},
                   {"json", c->json, 0},
                   {"effects", c->all_effects, 0},
                   {"strict", c->load.strict, 0},
                   {"quiet", c->quiet, 0},
                   {"reproducible", c->reproducible, 0},
                   {"selection", c->load.light_selection, 0},
                   {"sampler", c->render.integrator.sampler, -1},
                   {"strategy", c->render.integrator.strategy, -1},
                   {"filter", c->render.integrator.filter, -1},
                   {"radius", (double)c->render.integrator.filter_x, 0},
                   {"depth", c->render.integrator.max_depth, -2},
                   {"aov", c->render.planes, 0},
                   {"order", c->render.order_seed, 0},
                   {"reference", (double)c->sequence.reference_spp, 0}};
    fprintf(out, "%s %s ", actions[c->action], c->paths[PT_SCENE] ? c->paths[PT_SCENE] : "nothing");
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        print_text(out, texts[i].name, texts[i].text);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        print_number(out, numbers[i].name, numbers[i].value, numbers[i].usual);
    print_several(out, c);
    fprintf(out, "\n");
}

/* The words of the case, "a b" being one, into argv[128]. */
static int split_words(struct approve_case *c, char **argv)
{
    int argc = 1;
    strcpy(c->options, "lull-render");
    argv[0] = c->options;
    for (char *at = c->text; *at != '\0' && argc < 127;) {
        at += strspn(at, " \n");
        char *end = *at == '"' ? strchr(++at, '"') : at + strcspn(at, " \n");
        if (end == at && *end != '"')
            break;
        argv[argc++] = at;
        at = end + (*end != '\0');
        *end = '\0';
    }
    argv[argc] = NULL;
    return argc;
}

static char *parse_words(struct approve_case *c)
{
    char *argv[128], *text = NULL;
    size_t size;
    struct pt_cli cli;
    struct base_err err = {0};
    int argc = split_words(c, argv);
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    int rc = pt_cli_parse(&cli, argc, argv, &err);
    if (rc)
        fprintf(out, "%d: %s\n", rc, err.text);
    else
        print_cli(out, &cli);
    pt_cli_release(&cli);
    fclose(out);
    return text;
}

static void command_lines(void **state)
{
    (void)state;
    approve_cases("tests/golden/lull-render/command_lines.txt", parse_words);
}

/* --- what is made of it -------------------------------------------------------------------------------------------------- */

static char folder[] = "/tmp/pt_main_XXXXXX", criteria[2048];

static void write_files(void)
{
    struct base_err err = {0};
    uint8_t grey[24 * 9];
    for (int i = 0; i < 24 * 9; i++)
        grey[i] = i % 24 < 8 ? 255 : 0;
    assert_int_equal(
        base_file_write_line("s.pbrt",
                             "Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 9 "
                             "\"float cropwindow\" [ 0.25 1 0 0.5 ] \"float maxcomponentvalue\" 40\n"
                             "PixelFilter \"triangle\" \"float yradius\" 1.5 Integrator \"path\" \"integer maxdepth\" 7\n"
                             "Sampler \"independent\" Camera \"perspective\" WorldBegin Include \"i.pbrt\"",
                             &err),
        0);
    assert_int_equal(base_file_write_line("i.pbrt", "Material \"hair\" Shape \"sphere\" \"float radius\" 5", &err), 0);
    assert_int_equal(base_file_write_line("bad.pbrt", "WorldBegin Include \"missing.pbrt\"", &err), 0);
    assert_int_equal(pic_write_png("mask.png", 24, 9, 1, grey, &err), 0);
    assert_int_equal(pic_write_png("small.png", 2, 2, 1, grey, &err), 0);
}

static void print_render(FILE *out, const struct pt_open *s)
{
    const struct pt_render_config *c = &s->render->config;
    const struct pt_integrator *i = &c->integrator;
    fprintf(out,
            "%dx%d crop %d %d %d %d block %dx%d spp %llu to %llu%s budget %g overhead %g seam %g planes %u order %u pilot "
            "%llu %g\n",
            c->width, c->height, c->crop[0], c->crop[1], c->crop[2], c->crop[3], c->block_width, c->block_height,
            (unsigned long long)c->spp_min, (unsigned long long)c->spp_max, c->uniform ? " everywhere" : "",
            c->time_budget_s, c->max_check_overhead, c->max_seam, c->planes, c->order_seed, (unsigned long long)c->pilot_spp,
            c->pilot_s);
    fprintf(out, "depth %d rr %d sampler %d strategy %d filter %d %g %g sigma %g clamp %g seed %u aux %d\n", i->max_depth,
            i->rr_depth, i->sampler, i->strategy, i->filter, (double)i->filter_x, (double)i->filter_y,
            (double)i->filter_sigma, (double)i->max_component, i->seed, i->want_aux);
    fprintf(out, "threads %d kernel %s effects %x output %s criterion %s", base_threads_count(s->threads), s->kernel_name,
            s->scene->effects, s->frame->paths[PT_OUTPUT] ? s->frame->paths[PT_OUTPUT] : "none",
            s->criterion ? lull_host_table(s->criterion)->id : "none");
    for (uint32_t k = 0; s->criterion && k < s->render->blocks->count; k++)
        fprintf(out, " %d", (int)s->render->blocks->list[k].step);
    fprintf(out, "\n");
    for (size_t k = 0; k < s->scene_files.count; k++)
        fprintf(out, "read %s\n", s->scene_files.paths[k]);
}

/* What depends on the build is masked. */
static void print_settings(FILE *out, char *text)
{
    char *crc = strstr(text, "plugin-and-mask-crc=");
    if (crc)
        memcpy(crc + 20, "########", 8);
    crc = strstr(text, "version=");
    if (crc == text)
        text = strchr(text, '\n') + 1;
    fprintf(out, "%s", text);
}

static char *make_render(struct approve_case *c)
{
    char *argv[128], *text = NULL, at[4096];
    struct base_identity all = {0};
    size_t size;
    struct base_err err = {0};
    static struct pt_cli cli;
    static struct pt_open open;
    struct pt_shot_frame frame = {0};
    int argc = split_words(c, argv);
    FILE *out = open_memstream(&text, &size);
    assert_true(out && getcwd(at, sizeof at) && chdir(folder) == 0);
    open = (struct pt_open){0};
    int rc = pt_cli_parse(&cli, argc, argv, &err);
    if (!rc)
        rc = pt_frame_alone(&frame, &cli, &err);
    if (!rc)
        rc = pt_open_init(&open, &cli, NULL, NULL, &err);
    if (!rc)
        rc = pt_open_scene(&open, &frame, &err);
    if (!rc)
        rc = pt_open_frame(&open, NULL, &err);
    if (!rc)
        print_render(out, &open);
    if (!rc && cli.paths[PT_CHECKPOINT])
        rc = pt_agree_identity(&open, &all, &err);
    if (!rc && cli.paths[PT_CHECKPOINT])
        print_settings(out, all.text);
    base_identity_release(&all);
    if (rc)
        fprintf(out, "%d: %s\n", rc, err.text);
    pt_open_release(&open);
    pt_frame_release(&frame);
    pt_cli_release(&cli);
    fclose(out);
    assert_int_equal(chdir(at), 0);
    return text;
}

static void renders(void **state)
{
    (void)state;
    char command[128], at[4096];
    assert_true(mkdtemp(folder) && getcwd(at, sizeof at) && chdir(folder) == 0);
    write_files();
    assert_int_equal(chdir(at), 0);
    assert_true(api_folder(criteria, sizeof criteria, API_CRITERIA) == 0 && setenv("LULL_PLUGIN_PATH", criteria, 1) == 0);
    approve_cases("tests/golden/lull-render/renders.txt", make_render);
    unsetenv("LULL_PLUGIN_PATH");
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

/* What is written to a stream meanwhile; static. */
static int old_stream, stream_number;
static FILE *kept_stream;

static void listen_to(FILE *stream)
{
    fflush(stream);
    stream_number = fileno(stream);
    kept_stream = tmpfile();
    old_stream = dup(stream_number);
    assert_true(kept_stream && old_stream >= 0 && dup2(fileno(kept_stream), stream_number) == stream_number);
}

static const char *heard_on(FILE *stream)
{
    static char text[8192];
    fflush(stream);
    dup2(old_stream, stream_number);
    close(old_stream);
    rewind(kept_stream);
    text[fread(text, 1, sizeof text - 1, kept_stream)] = '\0';
    fclose(kept_stream);
    return text;
}

static void words_on_the_way(void **state)
{
    (void)state;
    assert_false(base_interrupted);
    base_interrupt_catch();
    raise(SIGTERM);
    assert_true(base_interrupted);
    base_interrupted = 0;
    base_interrupt_catch();
    raise(SIGHUP);
    assert_true(base_interrupted);
    signal(SIGHUP, SIG_IGN); /* nohup */
    base_interrupted = 0;
    base_interrupt_catch();
    assert_true(raise(SIGHUP) == 0 && raise(SIGPIPE) == 0 && !base_interrupted);
    signal(SIGHUP, SIG_DFL);
    raise(SIGINT);
    assert_true(base_interrupted);
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
    listen_to(stderr);
    struct base_log log, silent = {0};
    base_log_init(&log, stderr, "lull-render", 0);
    base_log_say(&log, "a %s", "line");
    base_log_note(&log, "a %s", "note");
    log.quiet = 1;
    base_log_note(&log, "a quiet note");
    base_log_say(&log, "a word");
    base_log_say(&silent, "from somebody else");
    base_log_say(NULL, "from nobody");
    base_log_note(NULL, "from nobody");
    assert_string_equal(heard_on(stderr), "lull-render: a line\nlull-render: a note\nlull-render: a word\n");
}

/* --- quotes ------------------------------------------------------------------------------------------------------------- */

/* 24 x 8 pixels, six blocks of 8 x 4, of which the last has no sample yet; every number of its own. The camera stands in a white
 * ball that no path leaves, so that each has as many vertices as it may have bounces. */
static struct pt_scene *scene;
static struct pt_render render;
static struct pt_quote quote;
static struct lull_host_block *list;
static struct lull_host_quote_row rows[3];
static struct lull_host_quote_block answers[3][7];
static struct base_threads *pool;
static double black[3]; /* of the first pixel */
static uint32_t no_drops[1];
static struct lull_criterion table;
static struct lull_host_criterion *criterion;

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
                                        .capped = k == 2 ? 5 : 0};
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
    struct base_err err = {0};
    const struct pt_render_config config = {.width = 24,
                                            .height = 9,
                                            .block_width = 8,
                                            .block_height = 4,
                                            .integrator = {.max_depth = 2, .rr_depth = 9, .max_component = INFINITY}};
    scene =
        text_scene("Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 9 Camera \"perspective\" WorldBegin\n"
                   "Shape \"sphere\" \"float radius\" 5",
                   NULL, NULL);
    pool = base_threads_create(2, &err);
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
    table = *pt_fake_criterion();
    table.id = "law";
    if (lull_host_create(NULL, &table, NULL, 0, &criterion, NULL) != LULL_OK ||
        lull_host_begin(&laid, criterion, &frame, NULL) != LULL_OK)
        return -1;
    list = lull_host_blocks_of(frame)->list;
    for (int i = 0; i < 7; i++) {
        list[i].id = 10u + (uint32_t)i;
        list[i].spp = i == 3 ? 0 : 16u + (uint32_t)i;
        list[i].thread_s = i == 3 ? 0 : 0.001 * (i + 1);
    }
    render = (struct pt_render){
        .config = config,
        .scene = scene,
        .threads = pool,
        .criterion = criterion,
        .busy_threads = 1.84,
        .film = {.x1 = 24, .y1 = 9, .pixels = 200, .bytes = 34567890, .color = black, .dropped = no_drops},
        .frame = frame,
        .blocks = lull_host_blocks_of(frame),
        .totals = lull_host_totals_of(frame)};
    render.totals->samples = 4321;
    render.totals->render_s = 50.5;
    render.totals->criterion_s = 60.75;
    quote =
        (struct pt_quote){.row_count = 3,
                          .rows = rows,
                          .threads = 2,
                          .settings = {{"error", 4, "draft"}, {"visible", 0.125, "as asked"}, {"visible", 0.05, "strict"}}};
    for (int k = 0; k < 3; k++)
        fill_row(&rows[k], k);
    return pool ? 0 : -1;
}

static int tear_down_quote(void **state)
{
    (void)state;
    lull_host_end(render.frame);
    lull_host_close(criterion);
    pt_scene_destroy(scene);
    base_threads_destroy(pool);
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
    quote.settings[1].parameter = strstr(c->text, "uniform") ? NULL : "visible";
    quote.settings[1].value = strstr(c->text, "default") ? 0.25 : 0.125;
    quote.settings[1].name = strstr(c->text, "default") ? "default" : "as asked";
    rows[1].unmet = strstr(c->text, "met") ? 0 : 1;
    quote.threads = strstr(c->text, "one-thread") ? 1 : 2;
    render.criterion = strstr(c->text, "uniform") ? NULL : criterion;
    if (strstr(c->text, "json"))
        assert_int_equal(pt_quote_json(out, &quote, &render, &info, &err), 0);
    else
        pt_quote_text(out, &quote, &render, &info);
    fclose(out);
    return text;
}

static void quotes(void **state)
{
    (void)state;
    approve_cases("tests/golden/lull-render/quotes.txt", print_quote);
}

/* --- at the end of a render --------------------------------------------------------------------------------------------- */

static char *written[3];
static int write_count, fails_until;

static int write_nothing(const char *path, const struct pt_render *r, const struct pt_output_info *info_of,
                         struct base_err *err)
{
    (void)r;
    (void)info_of;
    free(written[write_count]);
    written[write_count] = strdup(path);
    return write_count++ < fails_until ? base_fail(err, BASE_EIO, "%s: no paper", path) : 0;
}

/* What cannot be written where it was asked for is kept elsewhere, and said. */
static void outputs_are_kept(void **state)
{
    (void)state;
    const struct pt_output_info none = {0};
    char line[300], name[100];
    struct base_err err = {0};
    setenv("TMPDIR", "/elsewhere", 1);
    pt_output_or_keep(write_nothing, NULL, NULL, &none, &err);
    assert_int_equal(write_count, 0);
    pt_output_or_keep(write_nothing, "a/b.exr", NULL, &none, &err);
    assert_true(write_count == 1 && err.code == 0);
    for (int k = 1; k < 3; k++) { /* at first only here, then there too */
        write_count = 0;
        fails_until = k;
        err = (struct base_err){0};
        pt_output_or_keep(write_nothing, "a/b.exr", NULL, &none, &err);
        assert_int_equal(write_count, 2);
        snprintf(name, sizeof name, "/elsewhere/lull-%ld-b.exr", (long)getpid());
        assert_string_equal(written[1], name);
        snprintf(line, sizeof line, k == 1 ? "a/b.exr: no paper; kept as %s" : "a/b.exr: no paper", name);
        assert_string_equal(err.text, line);
        assert_int_equal(err.code, BASE_EIO);
    }
    err = (struct base_err){0};
    for (int k = 0; k < 3; k++) { /* each of several files is named: kept, kept, and lost */
        static const char *const paths[] = {"a/b.exr", "c.png", "d.json"};
        write_count = 0;
        fails_until = k < 2 ? 1 : 2;
        pt_output_or_keep(write_nothing, paths[k], NULL, &none, &err);
    }
    snprintf(line, sizeof line,
             "a/b.exr: no paper; kept as /elsewhere/lull-%ld-b.exr; c.png kept as /elsewhere/lull-%ld-c.png; d.json is lost",
             (long)getpid(), (long)getpid());
    assert_string_equal(err.text, line);
    err = (struct base_err){0};
    setenv("TMPDIR", "", 1);
    write_count = 0;
    pt_output_or_keep(write_nothing, "b.exr", NULL, &none, &err);
    snprintf(name, sizeof name, "/tmp/lull-%ld-b.exr", (long)getpid());
    assert_string_equal(written[1], name);
    unsetenv("TMPDIR");
    for (int i = 0; i < 3; i++)
        free(written[i]);
    assert_int_equal(pt_action_status(PT_RENDER_DONE), 0);
    assert_int_equal(pt_action_status(PT_RENDER_OUT_OF_TIME), 0);
    assert_int_equal(pt_action_status(PT_RENDER_PILOT), 0);
    assert_int_equal(pt_action_status(PT_RENDER_INTERRUPTED), 130);
    assert_int_equal(pt_action_status(PT_RENDER_LOST), 2);
}

static void the_last_line(void **state)
{
    (void)state;
    struct captured messages;
    for (int i = 0; i < 7; i++)
        list[i].reason = i < 3 ? LULL_REASON_CRITERION : i < 5 ? LULL_REASON_SPP_MAX : LULL_REASON_DROPPED;
    render.totals->paths = 123456789;
    render.totals->dropped = 12;
    lull_host_drop(render.frame, 7, 8, 9);
    capture_begin(&messages);
    messages.log.name = "lull-render";
    pt_action_summary(&render, &messages.log);
    messages.log.quiet = 1;
    pt_action_summary(&render, &messages.log);
    render.totals->dropped = 0;
    pt_action_summary(&render, &messages.log);
    capture_end(&messages);
    assert_string_equal(
        messages.text,
        "lull-render: 22 spp on average, 111.2 s, 2.44 Mpaths/s, criterion 54.6 %; blocks: 3 criterion 2 spp-max 2 dropped\n"
        "lull-render: 12 samples were not finite and were dropped, the first seen at --debug-path 7,8,9\n"
        "lull-render: 12 samples were not finite and were dropped, the first seen at --debug-path 7,8,9\n");
    for (int i = 0; i < 7; i++)
        list[i].reason = LULL_REASON_NONE;
}

/* A checkpoint that fails is said and tried again after its time; previews come when three times as long has passed, a minute later at
 * most, and take a hundredth of the time. */
static void between_two_slices(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct pt_cli cli = {.checkpoint_every_s = 1000};
    struct pt_shot_frame frame = {.paths = {[PT_CHECKPOINT] = "/missing/c"}};
    struct captured messages;
    struct pt_open open = {.cli = &cli, .frame = &frame, .log = &messages.log, .render = &render};
    struct pt_watch w;
    double before_s = base_clock_wall_s();
    capture_begin(&messages);
    messages.log.quiet = 1;
    pt_watch_init(&w, &open, NULL);
    assert_true(w.checkpoint_at_s >= before_s + 1000 && w.checkpoint_at_s <= base_clock_wall_s() + 1000);
    const struct pt_render_hooks hooks = pt_watch_hooks(&w);
    base_interrupted = 0;
    w.checkpoint_at_s = before_s + 1e6;
    hooks.slice(hooks.data, &render, &err); /* too early */
    w.checkpoint_at_s = before_s;
    base_interrupted = 1;
    assert_true(*hooks.interrupted);
    hooks.slice(hooks.data, &render, &err); /* too late */
    assert_true(w.checkpoint_at_s == before_s);
    base_interrupted = 0;
    assert_false(*hooks.interrupted);
    render.criterion = NULL;
    assert_int_equal(hooks.slice(hooks.data, &render, &err), 0);
    double after_s = base_clock_wall_s();
    assert_true(w.checkpoint_at_s >= before_s + 1000 && w.checkpoint_at_s <= after_s + 1000);
    assert_string_equal(messages.text,
                        "no checkpoint, the render goes on: /missing/c: cannot write there: No such file or directory\n");
    capture_end(&messages);
    assert_int_equal(hooks.suspend(hooks.data, &render, &err), BASE_EIO);
    frame.paths[PT_CHECKPOINT] = NULL;
    assert_int_equal(hooks.suspend(hooks.data, &render, &err), 0);
    static const double waits[2][2] = {{15, 45}, {100, 60}};
    const struct pt_output_info info = {0};
    frame.paths[PT_PREVIEW] = "/missing/p.png";
    w.info = &info;
    render.config.crop[2] = render.config.crop[3] = 1;
    for (int i = 0; i < 2; i++) {
        before_s = base_clock_wall_s();
        open.start_s = before_s - waits[i][0];
        w.files_at_s = before_s + 1e6;
        hooks.slice(hooks.data, &render, &err);
        assert_true(w.files_at_s == before_s + 1e6);
        w.files_at_s = 0;
        hooks.slice(hooks.data, &render, &err);
        after_s = base_clock_wall_s();
        assert_true(w.files_at_s >= before_s + waits[i][1]);
        assert_true(w.files_at_s <= after_s + fmax(waits[i][1] + 4 * (after_s - before_s), 100 * (after_s - before_s)));
    }
    cli.live = 1; /* each second, at most a twentieth of the time */
    w.files_at_s = 0;
    before_s = base_clock_wall_s();
    hooks.slice(hooks.data, &render, &err);
    after_s = base_clock_wall_s();
    assert_true(w.files_at_s >= before_s + 1 && w.files_at_s <= after_s + fmax(1, 20 * (after_s - before_s)));
}

/* --explain, but for the times. */
static char *explain_it(struct approve_case *c)
{
    struct pt_scene_defaults found;
    struct pt_scene *s = text_scene(c->text, &found, NULL);
    const struct pt_render_config config = {.width = found.width, .height = found.height, .integrator = found.integrator};
    s->stats.bytes = 12345678;
    listen_to(stdout);
    pt_action_explain(s, &config, "t.pbrt");
    char *text = strdup(heard_on(stdout)), *time = strstr(text, "time: "), *end = time ? strchr(time, '\n') : NULL;
    double us, ratio;
    assert_non_null(end);
    assert_int_equal(
        sscanf(time, "time: %lf us per path and thread; the general kernel takes %lf times as long for the same image", &us,
               &ratio),
        2);
    assert_true(us > 0 && ratio > 0);
    memmove(time + 6, end, strlen(end) + 1);
    pt_scene_destroy(s);
    return text;
}

static void explanations(void **state)
{
    (void)state;
    approve_cases("tests/golden/lull-render/explanations.txt", explain_it);
}

/* The picture of a quote is that of its blocks' times, in minutes when the most expensive one takes one. */
static void quotes_as_pictures(void **state)
{
    (void)state;
    struct base_err err = {0};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pt_main_%ld.png", (long)getpid());
    quote.settings[1].value = 0.125;
    for (int k = 0; k < 2; k++) {
        struct pic_canvas map;
        double values[7];
        struct pic_image image;
        for (int i = 0; i < 7; i++) {
            double value = answers[1][i].thread_s;
            answers[1][i].thread_s = k ? value * 60 / 9 : value; /* the most expensive: 9 s, or just a minute */
            values[i] = answers[1][i].thread_s / (k ? 60 : 1);
        }
        assert_int_equal(pt_quote_map(path, &quote, &render, &err), 0);
        assert_int_equal(lull_host_paint(render.blocks, values, k ? "min" : "s", &map, NULL), 0);
        assert_int_equal(pic_read(path, &image, &err), 0);
        assert_true(image.width == map.width && image.height == map.height && image.channels == 3 && image.u8);
        assert_memory_equal(image.u8, map.rgb, (size_t)(3 * map.width * map.height));
        pic_release(&image);
        free(map.rgb);
    }
    unlink(path);
    assert_int_equal(pt_quote_map("/missing/q.png", &quote, &render, &err), BASE_EIO);
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(command_lines),      cmocka_unit_test(renders),
                                       cmocka_unit_test(words_on_the_way),   cmocka_unit_test(quotes),
                                       cmocka_unit_test(outputs_are_kept),   cmocka_unit_test(the_last_line),
                                       cmocka_unit_test(between_two_slices), cmocka_unit_test(explanations),
                                       cmocka_unit_test(quotes_as_pictures), cmocka_unit_test(durations_and_thousands)};
    return cmocka_run_group_tests(tests, set_up_quote, tear_down_quote);
}
