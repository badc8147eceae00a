/* The command line of lull-render: how it is read, and the render that is opened for it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "app/actions.h"
#include "base/files.h"
#include "integ/integrator.h"
#include "host/frame.h"
#include "picture/png.h"
#include "support/api_folders.h"
#include "support/approve.h"

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
    approve_cases("tests/unit/pt_command_line.txt", parse_words);
}

/* --- what is opened for it ------------------------------------------------------------------------------------------------ */

static char folder[] = "/tmp/pt_command_line_XXXXXX", criteria[2048];

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
    approve_cases("tests/unit/pt_command_line_renders.txt", make_render);
    unsetenv("LULL_PLUGIN_PATH");
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(command_lines), cmocka_unit_test(renders)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
