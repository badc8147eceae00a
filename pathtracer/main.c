#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

#include "base/clock.h"
#include "base/files.h"
#include "base/inputs.h"
#include "base/peers.h"
#include "base/version.h"
#include "cli.h"
#include "explain.h"
#include "pbrt/load.h"
#include "quote_output.h"
#include "render/checkpoint.h"
#include "render/crew.h"
#include "render/crew_member.h"
#include "render/host_find.h"
#include "render/host_state.h"
#include "render/output.h"
#include "render/progress.h"
#include "render/quote.h"
#include "render/render.h"
#include "render/sequence.h"

/* The criterion when none is named. */
static const char DEFAULT_CRITERION[] = "observer";

enum { EXIT_FAILED = 1, EXIT_BAD_INPUT = 2, EXIT_INTERRUPTED = 130 };

static volatile sig_atomic_t interrupt_seen;

static void on_interrupt(int number)
{
    (void)number;
    interrupt_seen = 1;
}

/* The first SIGINT or SIGTERM asks for an end, a second one kills. */
static void catch_interrupt(void)
{
    struct sigaction action = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

struct session {
    struct pt_cli cli;
    struct base_inputs scene_files, judging; /* what was read; judging: plugin and mask */
    struct base_peers *peers;  /* NULL: this process is alone */
    struct pt_crew *crew;      /* of rank 0 */
    struct base_threads *threads;
    struct pt_scene *scene;
    struct pt_scene_defaults defaults;
    struct pt_mask mask;
    struct pt_criterion *criterion;
    struct pt_render *render;
    struct pt_quote *quote;
    double start_s;         /* wall time of the program's start */
    struct pt_progress progress;
    pt_kernel *kernel;
    const char *kernel_name;
    char settings[4096];    /* what decides the image, for checkpoints */
    double checkpoint_at_s; /* wall time of the next one */
    char default_output[1024];
};

/* Of several processes rank 0 speaks. */
static void say(void *data, const char *line)
{
    struct session *s = data;
    if (s->peers && s->peers->rank > 0)
        return;
    pt_progress_clear(&s->progress);
    fprintf(stderr, "pathtracer: %s\n", line);
}

/* Notes are for people at the terminal; -q has none. */
static void note(void *data, const char *line)
{
    struct session *s = data;
    if (!s->cli.quiet)
        say(data, line);
}

/* --- setting up ----------------------------------------------------------------------------------------------------- */

static int load_scene(struct session *s, struct base_err *err)
{
    struct pt_load_options options = {.strict = s->cli.strict, .width = s->cli.width, .height = s->cli.height,
                                      .view = s->cli.view, .light_selection = s->cli.light_selection,
                                      .forced = s->cli.all_effects ? PT_FX_ALL : 0,
                                      .quiet = s->cli.quiet, .inputs = &s->scene_files, .warn = note, .warn_data = s};
    int rc = pt_scene_load(s->cli.scene, &options, &s->scene, &s->defaults, err);
    if (rc)
        return rc;
    s->kernel = pt_kernel_select(s->scene->effects, NULL, &s->kernel_name);
    return 0;
}

static void override_integrator(const struct pt_cli *cli, struct pt_integrator *i)
{
    i->seed = cli->seed;
    if (cli->sampler >= 0)
        i->sampler = cli->sampler;
    if (cli->strategy >= 0)
        i->strategy = cli->strategy;
    if (cli->max_depth != PT_CLI_SCENES_DEPTH)
        i->max_depth = cli->max_depth;
    if (cli->filter >= 0) {
        static const float usual_radius[3] = {0.5f, 1.0f, 1.5f};
        i->filter = cli->filter;
        i->filter_x = i->filter_y = cli->filter_radius > 0.0 ? (float)cli->filter_radius : usual_radius[cli->filter];
        i->filter_sigma = 0.5f;
    }
}

static int make_config(const struct session *s, struct pt_render_config *config, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    *config = (struct pt_render_config){
        .width = s->defaults.width,
        .height = s->defaults.height,
        .block_width = cli->block_width,
        .block_height = cli->block_height,
        .spp_min = cli->spp > 0 ? cli->spp : cli->spp_min,
        .spp_max = cli->spp > 0 ? cli->spp : cli->spp_max,
        .uniform = cli->spp > 0,
        .time_budget_s = cli->time_budget_s,
        .max_check_overhead = cli->max_check_overhead,
        .max_seam = cli->max_seam,
        .planes = cli->aov,
        .integrator = s->defaults.integrator,
        .order_seed = cli->order_seed,
        .pilot_spp = cli->pilot_spp,
        .pilot_s = cli->pilot_s,
        .crew = s->crew,
    };
    memcpy(config->crop, cli->has_crop ? cli->crop : s->defaults.crop, sizeof config->crop);
    override_integrator(cli, &config->integrator);
    if (config->crop[2] > config->width || config->crop[3] > config->height)
        return base_fail(err, BASE_EINVAL, "--crop %d,%d,%d,%d: the image has %dx%d pixels", config->crop[0],
                         config->crop[1],
                       config->crop[2], config->crop[3], config->width, config->height);
    return 0;
}

static int open_criterion(struct session *s, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    const char *spec = cli->criterion ? cli->criterion : DEFAULT_CRITERION;
    if (!cli->criterion && cli->spp > 0)
        return 0;
    const struct lull_criterion *table;
    int rc = pt_criterion_find(spec, &s->judging, note, s, &table, err);
    if (!rc)
        rc = pt_criterion_create(table, cli->params, cli->param_count, s->threads, note, s, &s->criterion, err);
    if (rc || !cli->mask)
        return rc;
    rc = pt_mask_read(cli->mask, s->defaults.width, s->defaults.height, &s->mask, err);
    if (!rc)
        rc = base_inputs_add(&s->judging, cli->mask, err);
    return rc ? rc : pt_criterion_set_mask(s->criterion, &s->mask, cli->params, cli->param_count, err);
}

/* Outputs that cannot be written, or that would overwrite what the image is made from, are found out before the work. */
static int check_output(const struct session *s, const char *path, struct base_err *err)
{
    int rc = base_file_check_output(path, err);
    if (!rc)
        rc = base_inputs_protect(&s->scene_files, path, err);
    return rc ? rc : base_inputs_protect(&s->judging, path, err);
}

static int check_outputs(struct session *s, struct base_err *err)
{
    struct pt_cli *cli = &s->cli;
    if (!cli->quote && !cli->output && !cli->preview && !cli->report && cli->stop_map_count == 0) {
        const char *slash = strrchr(cli->scene, '/'), *name = slash ? slash + 1 : cli->scene;
        const char *dot = strrchr(name, '.');
        int n = dot ? (int)(dot - name) : (int)strlen(name);
        if (n > (int)sizeof s->default_output - 8)
            return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", cli->scene);
        snprintf(s->default_output, sizeof s->default_output, "%.*s.exr", n, name);
        cli->output = s->default_output;
    }
    const char *paths[] = {cli->output, cli->preview, cli->report, cli->checkpoint, cli->quote_map};
    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
        if (check_output(s, paths[i], err) != 0)
            return BASE_EINVAL;
    for (int i = 0; i < cli->stop_map_count; i++)
        if (check_output(s, cli->stop_maps[i], err) != 0)
            return BASE_EINVAL;
    return 0;
}

static int file_crc(const char *path, uint32_t *crc, struct base_err *err)
{
    struct base_inputs one = BASE_INPUTS_EMPTY;
    int rc = base_inputs_add(&one, path, err);
    if (!rc)
        rc = base_inputs_crc32(&one, crc, err);
    base_inputs_release(&one);
    return rc;
}

/* Everything that decides the bytes of the image, and nothing else. A criterion's model is in its saved state. */
static int describe_settings(struct session *s, const struct pt_render_config *c, struct base_err *err)
{
    uint32_t scene_crc = 0, judging_crc = 0;
    if (!s->cli.checkpoint && !s->peers)
        return 0;
    int rc = base_inputs_crc32(&s->scene_files, &scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&s->judging, &judging_crc, err);
    if (rc)
        return rc;
    const struct pt_integrator *i = &c->integrator;
    size_t room = sizeof s->settings, used = (size_t)snprintf(
        s->settings, room,
        "scene-crc=%08x\nsize=%dx%d\ncrop=%d,%d,%d,%d\nblock=%dx%d\nspp-min=%llu\nspp-max=%llu\nuniform=%d\nmax-seam=%g\n"
        "aov=%u\nseed=%u\nsampler=%d\nintegrator=%d\nfilter=%d:%gx%g:%g\n"
        "light-selection=%s\nmax-depth=%d\nrr-depth=%d\nclamp=%g\n",
        scene_crc, c->width, c->height, c->crop[0], c->crop[1], c->crop[2], c->crop[3], c->block_width, c->block_height,
        (unsigned long long)c->spp_min, (unsigned long long)c->spp_max, c->uniform, c->max_seam, c->planes, i->seed,
        i->sampler, i->strategy, i->filter, (double)i->filter_x, (double)i->filter_y, (double)i->filter_sigma,
        pt_light_selection_words[s->cli.light_selection], i->max_depth,
        i->rr_depth, (double)i->max_component);
    const struct pt_view *view = &s->cli.view;
    used += (size_t)snprintf(s->settings + used, room - used, "fov=%.17g\nlook-at=", view->fov_deg);
    for (int k = 0; view->has_look_at && k < 9; k++)
        used += (size_t)snprintf(s->settings + used, room - used, "%.17g ", view->look_at_world[k]);
    const struct lull_criterion *t = s->criterion ? s->criterion->table : NULL;
    used += (size_t)snprintf(s->settings + used, room - used, "\ncriterion=%s %s\n", t ? t->id : "none",
                             t ? t->version : "");
    if (used < room)
        used += (size_t)snprintf(s->settings + used, room - used, "plugin-and-mask-crc=%08x\n", judging_crc);
    for (uint32_t k = 0; k < s->cli.param_count && used < room; k++)
        used += (size_t)snprintf(s->settings + used, room - used, "param=%s=%s\n", s->cli.params[k].key,
                                 s->cli.params[k].value);
    return used < room ? 0 : base_fail(err, BASE_EINVAL, "the criterion's parameters are too long");
}

/* --- several processes ------------------------------------------------------------------------------------------------ */

/* What every process of a job must agree about: the settings, and the model that the criterion starts with. */
static int describe_job(const struct session *s, char *text, size_t room, struct base_err *err)
{
    unsigned char *state = NULL;
    size_t size = 0;
    int rc = s->render && s->criterion ? pt_criterion_save(s->criterion, &state, &size, err) : 0;
    if (rc)
        return rc;
    snprintf(text, room, "version=%s\n%scriterion-model-crc=%08x\n", BASE_VERSION, s->settings,
             (unsigned)crc32_z(0, state, size));
    free(state);
    return 0;
}

/* Rank 0, ready to begin. */
static int greet_crew(const struct session *s, struct base_err *err)
{
    char text[sizeof s->settings + 128];
    int rc = s->crew ? describe_job(s, text, sizeof text, err) : 0;
    return rc || !s->crew ? rc : pt_crew_greet(s->crew, text, err);
}

/* --- rendering ------------------------------------------------------------------------------------------------------ */

/* A checkpoint that fails on the way costs nothing yet: the next one may succeed. */
static void save_now_and_then(struct session *s, const struct pt_render *render)
{
    struct base_err why = {0};
    char line[640];
    if (pt_checkpoint_save(s->cli.checkpoint, render, s->settings, &why) != 0) {
        snprintf(line, sizeof line, "no checkpoint, the render goes on: %s", why.text);
        say(s, line);
    }
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
}

static int after_slice(void *data, struct pt_render *render, struct base_err *err)
{
    struct session *s = data;
    (void)err;
    pt_progress_update(&s->progress, render);
    if (s->cli.checkpoint && !interrupt_seen && base_clock_wall_s() >= s->checkpoint_at_s)
        save_now_and_then(s, render);
    return 0;
}

static int on_suspend(void *data, struct pt_render *render, struct base_err *err)
{
    struct session *s = data;
    return s->cli.checkpoint ? pt_checkpoint_save(s->cli.checkpoint, render, s->settings, err) : 0;
}

static int interrupted(void *data)
{
    (void)data;
    return interrupt_seen != 0;
}

typedef int writer(const char *path, const struct pt_render *render, const struct pt_output_info *info,
                   struct base_err *err);

static int write_preview(const char *path, const struct pt_render *render, const struct pt_output_info *info,
                         struct base_err *err)
{
    (void)info;
    return pt_output_preview(path, render, err);
}

/* What cannot be written after all is kept where temporary files go. On failure err says so; on success it stays. */
static void write_or_keep(const struct session *s, writer *write, const char *path, const struct pt_output_info *info,
                          struct base_err *err)
{
    struct base_err why = {0}, again = {0};
    char kept[4096];
    if (!path || write(path, s->render, info, &why) == 0)
        return;
    *err = why;
    const char *folder = getenv("TMPDIR"), *slash = strrchr(path, '/');
    int n = snprintf(kept, sizeof kept, "%s/lull-%ld-%s", folder && folder[0] != '\0' ? folder : "/tmp", (long)getpid(),
                     slash ? slash + 1 : path);
    if (n < (int)sizeof kept && write(kept, s->render, info, &again) == 0)
        base_fail(err, why.code, "%.320s; kept as %.160s", why.text, kept);
}

/* Writes what was asked for; goes on after a failure so that one missing folder does not cost the other files. */
static int write_outputs(struct session *s, int was_interrupted, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    struct pt_output_info info = {.scene = cli->scene, .params = cli->params, .param_count = cli->param_count,
                                  .mask = cli->mask, .effects = s->scene->effects, .kernel = s->kernel_name,
                                  .threads = pt_render_threads(s->render), .reproducible = cli->reproducible,
                                  .aov = cli->aov, .scene_bytes = s->scene->stats.bytes, .interrupted = was_interrupted};
    write_or_keep(s, pt_output_exr, cli->output, &info, err);
    write_or_keep(s, write_preview, cli->preview, &info, err);
    for (int i = 0; i < cli->stop_map_count; i++)
        write_or_keep(s, pt_output_stop_map, cli->stop_maps[i], &info, err);
    write_or_keep(s, pt_output_report, cli->report, &info, err);
    return err->code;
}

static void tell_summary(struct session *s)
{
    const struct pt_render *r = s->render;
    uint32_t by_reason[PT_REASON_COUNT] = {0};
    for (uint32_t i = 0; i < r->blocks.count; i++)
        by_reason[r->blocks.list[i].reason]++;
    double pixels = (double)r->film.pixels;
    char line[512];
    size_t used = (size_t)snprintf(line, sizeof line,
                                   "%.0f spp on average, %.1f s, %.2f Mpaths/s, criterion %.1f %%; blocks:",
                                   (double)r->totals.samples / pixels, pt_render_elapsed_s(r),
                                   (double)r->totals.paths / fmax(r->totals.render_s, 1e-9) * 1e-6,
                                   100.0 * r->totals.criterion_s / fmax(pt_render_elapsed_s(r), 1e-9));
    for (int i = 0; i < PT_REASON_COUNT && used < sizeof line; i++)
        if (by_reason[i] > 0)
            used += (size_t)snprintf(line + used, sizeof line - used, " %u %s", by_reason[i], pt_block_reason_name(i));
    note(s, line);
    if (r->totals.dropped > 0) {
        snprintf(line, sizeof line, "%llu samples were not finite and were dropped, the first seen at --debug-path %u,%u,%u",
                 (unsigned long long)r->totals.dropped, r->dropped[0].x, r->dropped[0].y, r->dropped[0].sample);
        say(s, line);
    }
}

/* The render with its criterion, as the command line says. */
static int create_render(struct session *s, struct base_err *err)
{
    struct pt_render_config config;
    int rc = make_config(s, &config, err);
    if (!rc)
        rc = open_criterion(s, err);
    if (!rc && (!s->peers || s->peers->rank == 0)) /* the others write nothing */
        rc = check_outputs(s, err);
    if (!rc)
        rc = describe_settings(s, &config, err);
    return rc ? rc : pt_render_create(&config, s->scene, s->kernel, s->threads, s->criterion, &s->render, err);
}

/* …and as far as a checkpoint to be resumed had come. */
static int open_render(struct session *s, struct base_err *err)
{
    int rc = create_render(s, err);
    if (!rc)
        rc = greet_crew(s, err);
    if (!rc && s->cli.resume)
        rc = pt_checkpoint_load(s->cli.checkpoint, s->render, s->settings, err);
    if (rc == BASE_EIO)
        rc = err->code = BASE_EINVAL; /* the checkpoint is an input */
    return rc;
}

static int status_of(enum pt_render_outcome outcome)
{
    return outcome == PT_RENDER_INTERRUPTED ? EXIT_INTERRUPTED : outcome == PT_RENDER_LOST ? EXIT_BAD_INPUT : 0;
}

static int render_image(struct session *s, int *status, struct base_err *err)
{
    enum pt_render_outcome outcome;
    int rc = open_render(s, err);
    if (rc)
        return rc;
    struct pt_render_hooks hooks = {.slice = after_slice, .interrupted = interrupted, .suspend = on_suspend, .warn = say,
                                    .data = s};
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
    rc = pt_render_run(s->render, &hooks, &outcome, err);
    pt_progress_clear(&s->progress);
    struct base_err write_err = {0};
    if (write_outputs(s, status_of(outcome) != 0, &write_err) != 0) {
        if (rc)
            say(s, write_err.text); /* besides the render's own error: it tells where the image is */
        else
            rc = base_fail(err, write_err.code, "%s", write_err.text);
        return rc;
    }
    tell_summary(s);
    *status = status_of(outcome);
    return rc;
}

/* --- what it will cost ------------------------------------------------------------------------------------------------ */

static void ask_quote(void *data, struct pt_render *render, const uint32_t *due, uint32_t count)
{
    struct session *s = data;
    pt_quote_ask(s->quote, render, due, count);
}

/* The pilot is over: the checkpoint is the render's, whoever goes on with it. */
static int tell_quote(struct session *s, double load_s, int was_interrupted, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    int rc = pt_quote_finish(s->quote, s->render, err);
    if (rc)
        return rc;
    struct pt_quote_info info = {.scene = cli->scene, .params = cli->params, .param_count = cli->param_count,
                                 .scene_bytes = s->scene->stats.bytes, .load_s = load_s, .interrupted = was_interrupted};
    if (cli->json)
        rc = pt_quote_json(stdout, s->quote, s->render, &info, err);
    else
        pt_quote_text(stdout, s->quote, s->render, &info);
    return rc || !cli->quote_map ? rc : pt_quote_map(cli->quote_map, s->quote, s->render, err);
}

static int quote_image(struct session *s, int *status, struct base_err *err)
{
    enum pt_render_outcome outcome;
    double load_s = base_clock_wall_s() - s->start_s;
    int rc = open_render(s, err);
    if (!rc)
        rc = pt_quote_create(s->render, s->criterion ? s->criterion->table : NULL, s->cli.params, s->cli.param_count,
                             s->cli.mask ? &s->mask : NULL, say, s, &s->quote, err);
    if (rc)
        return rc;
    struct pt_render_hooks hooks = {.slice = after_slice, .judged = ask_quote, .interrupted = interrupted,
                                    .suspend = on_suspend, .warn = say, .data = s};
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
    rc = pt_render_run(s->render, &hooks, &outcome, err);
    pt_progress_clear(&s->progress);
    if (!rc && s->cli.checkpoint && status_of(outcome) == 0)
        rc = pt_checkpoint_save(s->cli.checkpoint, s->render, s->settings, err);
    if (!rc && outcome != PT_RENDER_LOST)
        rc = tell_quote(s, load_s, outcome == PT_RENDER_INTERRUPTED, err);
    *status = status_of(outcome);
    return rc;
}

/* --- other actions -------------------------------------------------------------------------------------------------- */

static void explain(struct session *s)
{
    struct pt_integrator integrator = s->defaults.integrator;
    override_integrator(&s->cli, &integrator);
    pt_explain(s->scene, &s->defaults, &integrator, s->cli.scene);
}

static void print_line(void *data, const char *text)
{
    (void)data;
    puts(text);
}

static int debug_path(struct session *s, struct base_err *err)
{
    struct pt_integrator integrator = s->defaults.integrator;
    const int *at = s->cli.debug;
    override_integrator(&s->cli, &integrator);
    if (at[0] >= s->defaults.width || at[1] >= s->defaults.height)
        return base_fail(err, BASE_EINVAL, "--debug-path %d,%d,%d: the image has %dx%d pixels", at[0], at[1], at[2],
                         s->defaults.width, s->defaults.height);
    pt_kernel_trace(s->scene, &integrator, (uint32_t)at[0], (uint32_t)at[1], (uint32_t)at[2], print_line, NULL);
    return 0;
}

/* What deals with the settings of a recording besides pt_sequence_record. */
static int open_sequence(struct session *s, struct pt_render_config *config, struct base_err *err)
{
    int rc = make_config(s, config, err);
    if (!rc && s->cli.criterion)
        rc = open_criterion(s, err);
    return rc ? rc : describe_settings(s, config, err);
}

static int record_sequence(struct session *s, int *status, struct base_err *err)
{
    struct pt_sequence_config config = {.directory = s->cli.sequence, .levels = s->cli.levels,
                                        .blocks = s->cli.sequence_blocks,
                                        .reference_spp = s->cli.reference_spp, .scene_path = s->cli.scene,
                                        .name = s->cli.name, .view = s->cli.view, .quiet = s->cli.quiet,
                                        .slice = after_slice};
    int rc = open_sequence(s, &config.render, err);
    if (!rc)
        rc = file_crc(s->cli.scene, &config.scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&s->scene_files, &config.inputs_crc, err);
    if (!rc)
        rc = greet_crew(s, err);
    if (rc)
        return rc;
    int was_interrupted = 0;
    rc = pt_sequence_record(&config, s->scene, s->kernel, s->threads, s->criterion, interrupted, say, s, &was_interrupted,
                            err);
    pt_progress_clear(&s->progress);
    *status = was_interrupted ? EXIT_INTERRUPTED : 0;
    return rc;
}

/* Threads and scene. */
static int open_session(struct session *s, struct base_err *err)
{
    s->threads = base_threads_create(s->cli.threads > 0 ? s->cli.threads : base_peers_threads(s->peers), err);
    if (!s->threads)
        return BASE_ENOMEM;
    int rc = load_scene(s, err);
    if (rc == BASE_EIO)
        rc = err->code = BASE_EINVAL; /* the scene and its files are inputs */
    return rc;
}

static int run(struct session *s, int *status, struct base_err *err)
{
    if (s->cli.action == PT_CLI_LIST_CRITERIA) {
        if (pt_criterion_list(stdout, note, s) == 0)
            return base_fail(err, BASE_EINVAL, "no criterion was found (LULL_PLUGIN_PATH names more folders to look in)");
        return 0;
    }
    int rc = open_session(s, err);
    if (rc)
        return rc;
    catch_interrupt();
    switch (s->cli.action) {
    case PT_CLI_EXPLAIN:
        explain(s);
        return 0;
    case PT_CLI_DEBUG_PATH:
        return debug_path(s, err);
    case PT_CLI_QUOTE:
        return quote_image(s, status, err);
    case PT_CLI_SEQUENCE:
        return record_sequence(s, status, err);
    default:
        return render_image(s, status, err);
    }
}

static struct pt_crew_tools tools_of(const struct session *s)
{
    return (struct pt_crew_tools){s->threads, {s->scene, s->kernel, NULL}, s->render};
}

/* Makes everything as rank 0 makes it, and tells it what that is. */
static int join_crew(struct session *s, struct base_err *err)
{
    char text[sizeof s->settings + 128];
    struct pt_render_config config;
    int rc = open_session(s, err);
    if (!rc)
        rc = s->cli.action == PT_CLI_SEQUENCE ? open_sequence(s, &config, err) : create_render(s, err);
    if (!rc)
        rc = describe_job(s, text, sizeof text, err);
    const struct pt_crew_tools tools = tools_of(s);
    return rc ? rc : pt_crew_member_join(s->peers, &tools, text, err);
}

/* Any process but rank 0. rc: what became of the command line. Who interrupts or ends the job does it through rank 0. */
static int run_member(struct session *s, int rc, struct base_err *err)
{
    struct base_err unheard = {0};
    int renders = s->cli.action == PT_CLI_RENDER || s->cli.action == PT_CLI_QUOTE || s->cli.action == PT_CLI_SEQUENCE;
    signal(SIGINT, SIG_IGN);
    signal(SIGTERM, SIG_IGN);
    if (!rc && renders)
        rc = join_crew(s, err);
    if (rc)
        pt_crew_member_fail(s->peers, err, &unheard);
    const struct pt_crew_tools tools = tools_of(s);
    return pt_crew_member_serve(s->peers, rc || !renders ? NULL : &tools, &unheard);
}

static void release(struct session *s)
{
    pt_quote_destroy(s->quote);
    pt_render_destroy(s->render);
    pt_criterion_destroy(s->criterion);
    pt_mask_release(&s->mask);
    pt_scene_destroy(s->scene);
    base_threads_destroy(s->threads);
    base_inputs_release(&s->scene_files);
    base_inputs_release(&s->judging);
    pt_cli_release(&s->cli);
}

int main(int argc, char **argv)
{
    static struct session s = {.scene_files = BASE_INPUTS_EMPTY, .judging = BASE_INPUTS_EMPTY};
    struct base_err err = {0}, peers_err = {0};
    int status = 0;
    s.start_s = base_clock_wall_s();
    int rc = pt_cli_parse(&s.cli, argc, argv, &err);
    if (base_peers_open(&s.peers, rc ? &peers_err : &err) != 0 && !rc)
        rc = err.code;
    if (s.peers && s.peers->rank > 0) {
        rc = run_member(&s, rc, &err);
        release(&s);
        base_peers_close(s.peers);
        return rc ? EXIT_FAILED : 0;
    }
    if (s.peers && pt_crew_create(s.peers, s.cli.rank_timeout_s, &s.crew, rc ? &peers_err : &err) != 0 && !rc)
        rc = err.code;
    if (!rc) {
        pt_progress_init(&s.progress, s.cli.quiet ? NULL : stderr);
        rc = run(&s, &status, &err);
    }
    if (rc) {
        pt_progress_clear(&s.progress);
        fprintf(stderr, "pathtracer: %s\n", err.text);
        status = rc == BASE_EINVAL || rc == BASE_EIO ? EXIT_BAD_INPUT : EXIT_FAILED;
    }
    release(&s);
    if ((fflush(stdout) != 0 || ferror(stdout)) && status == 0) {
        fprintf(stderr, "pathtracer: cannot write standard output\n");
        status = EXIT_BAD_INPUT;
    }
    pt_crew_dismiss(s.crew, status);
    base_peers_close(s.peers);
    return status;
}
