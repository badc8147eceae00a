#include "open.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/files.h"
#include "pbrt/load.h"
#include "render/host_find.h"
#include "render/output.h"
#include "sample/sampler.h"

/* --- scene ---------------------------------------------------------------------------------------------------------- */

/* What the command line puts over the scene's integrator. */
static void override(const struct pt_integrator *by, struct pt_integrator *i)
{
    i->seed = by->seed;
    if (by->sampler >= 0)
        i->sampler = by->sampler;
    if (by->strategy >= 0)
        i->strategy = by->strategy;
    if (by->max_depth != PT_CLI_SCENES_DEPTH)
        i->max_depth = by->max_depth;
    if (by->filter >= 0) {
        static const float usual_radius[3] = {0.5f, 1.0f, 1.5f};
        i->filter = by->filter;
        i->filter_x = i->filter_y = by->filter_x > 0 ? by->filter_x : usual_radius[by->filter];
        i->filter_sigma = 0.5f;
    }
}

/* Says where the time went when a person would have noticed it. */
static void note_slow_load(struct base_log *log, const char *path, const struct pt_scene_stats *stats)
{
    const double noticeable_s = 3;
    double total_s = stats->parse_s + stats->texture_s + stats->build_s + stats->accel_s;
    if (total_s >= noticeable_s)
        base_log_note(log,
                      "%.200s: loaded in %.1f s: text and meshes %.1f, textures %.1f, acceleration structure %.1f, the rest "
                      "%.1f",
                      path, total_s, stats->parse_s, stats->texture_s, stats->accel_s, stats->build_s);
}

int pt_open_scene(const struct pt_cli *cli, struct job *job, struct base_log *log, struct pt_open *o, struct base_err *err)
{
    struct pt_load_options options = cli->load;
    struct pt_scene_defaults found;
    *o = (struct pt_open){.start_s = base_clock_wall_s(), .scene_files = BASE_INPUTS_EMPTY, .judging = BASE_INPUTS_EMPTY};
    o->threads = base_threads_create(cli->threads > 0 ? cli->threads : job_threads(job), err);
    if (!o->threads)
        return BASE_ENOMEM;
    options.inputs = &o->scene_files;
    options.log = log;
    int rc = pt_scene_load(cli->scene, &options, &o->scene, &found, err);
    if (rc)
        return rc == BASE_EIO ? (err->code = BASE_EINVAL) : rc; /* the scene and its files are inputs */
    o->kernel = pt_kernel_select(o->scene->effects, NULL, &o->kernel_name);
    o->config = cli->render;
    o->config.width = found.width;
    o->config.height = found.height;
    if (!cli->has_crop)
        memcpy(o->config.crop, found.crop, sizeof found.crop);
    o->config.integrator = found.integrator;
    override(&cli->render.integrator, &o->config.integrator);
    o->load_s = base_clock_wall_s() - o->start_s;
    note_slow_load(log, cli->scene, &o->scene->stats);
    return 0;
}

/* --- criterion ------------------------------------------------------------------------------------------------------ */

static const char *parameter(const struct pt_cli_params *params, const char *key)
{
    const char *value = NULL;
    for (uint32_t i = 0; i < params->count; i++)
        if (strcmp(params->list[i].key, key) == 0)
            value = params->list[i].value;
    return value;
}

/* A criterion that can judge either picture judges the one that is kept, unless a parameter says otherwise. */
static int add_picture(struct pt_cli_params *params, enum pt_picture kept, const struct lull_criterion *table,
                       struct base_err *err)
{
    const struct lull_param *picture = NULL;
    lull_host_parameter(table, "picture", params->list, params->count, &picture);
    if (kept != PT_PICTURE_DENOISED || !picture || parameter(params, "picture"))
        return 0;
    if (params->count == PT_CLI_MAX_PARAMS)
        return base_fail(err, BASE_EINVAL, "more than %d parameters", PT_CLI_MAX_PARAMS);
    params->list[params->count++] = (struct lull_pair){"picture", "denoised"};
    return 0;
}

/* A denoiser that is not there is found out before the work. */
static int open_denoiser(const struct pt_cli *cli, struct pt_open *o, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    o->picture = cli->picture;
    o->denoiser = parameter(&cli->params, "library");
    o->config.planes |= pt_denoised_planes(o->picture);
    int32_t code = o->picture == PT_PICTURE_NOISY ? LULL_OK : lull_host_denoiser(o->denoiser, &e);
    return code == LULL_OK ? 0 : base_fail(err, BASE_EINVAL, "--denoise: %s", e.message);
}

static int open_criterion(struct pt_cli *cli, struct base_log *log, struct pt_open *o, struct base_err *err)
{
    const char *usual = o->picture == PT_PICTURE_NOISY ? PT_OPEN_NOISY_CRITERION : "denoised";
    const struct lull_criterion *table;
    int rc = pt_criterion_find(cli->criterion ? cli->criterion : usual, &o->judging, log, &table, err);
    if (!rc)
        rc = add_picture(&cli->params, o->picture, table, err);
    if (!rc)
        rc = pt_criterion_create(table, cli->params.list, cli->params.count, o->threads, log, &o->criterion, err);
    if (rc || !cli->mask)
        return rc;
    rc = pt_mask_read(cli->mask, o->config.width, o->config.height, &o->mask, err);
    if (!rc)
        rc = base_inputs_add(&o->judging, cli->mask, err);
    o->config.mask = &o->mask;
    return rc;
}

/* --- outputs -------------------------------------------------------------------------------------------------------- */

/* A parameter may name a file: a model. */
static int protect_parameters(const struct pt_cli *cli, struct base_err *err)
{
    struct base_inputs named = BASE_INPUTS_EMPTY;
    int rc = 0;
    for (uint32_t i = 0; i < cli->params.count && !rc; i++)
        if (base_file_check_input(cli->params.list[i].value, NULL) == 0)
            rc = base_inputs_add(&named, cli->params.list[i].value, err);
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &named, err);
    base_inputs_release(&named);
    return rc;
}

/* By the scene's name in the current folder. */
static int name_output(struct pt_cli *cli, struct base_err *err)
{
    struct pt_image_files *files = &cli->files;
    const char *name = base_file_name(cli->scene), *dot = strrchr(name, '.');
    int n = dot ? (int)(dot - name) : (int)strlen(name);
    if (n > (int)sizeof files->default_output - 8)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", cli->scene);
    snprintf(files->default_output, sizeof files->default_output, "%.*s.exr", n, name);
    files->output = files->default_output;
    int rc = base_outputs_add(&cli->outputs, "output", files->output, err);
    if (!rc && !pt_output_is_ours(files->output)) /* nobody asked for this name */
        rc = base_fail(err, BASE_EINVAL, "%s: another program's image would be replaced; -o FILE.exr names the output",
                       files->output);
    return rc;
}

/* Outputs that would overwrite what the image is made from, or each other, are found out before the work. */
static int check_outputs(struct pt_cli *cli, const struct pt_open *o, struct base_err *err)
{
    int rc = cli->action == PT_CLI_RENDER && !pt_cli_writes_image(cli) ? name_output(cli, err) : 0;
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &o->scene_files, err);
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &o->judging, err);
    return rc ? rc : protect_parameters(cli, err);
}

/* --- identity ------------------------------------------------------------------------------------------------------- */

/* Everything that decides the bytes of the image, and nothing else: the options, with the scene's own settings where they
 * say nothing, and what was read. A criterion's model is in its saved state. */
static int identify(const struct pt_cli *cli, struct pt_open *o, struct base_err *err)
{
    struct base_identity *id = &o->identity;
    struct pt_cli all = *cli;
    const struct pt_integrator *i = &o->config.integrator;
    const struct lull_criterion *t = o->criterion ? lull_host_table(o->criterion) : NULL;
    uint32_t scene_crc = 0, judging_crc = 0;
    int rc = base_inputs_crc32(&o->scene_files, &scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&o->judging, &judging_crc, err);
    if (rc)
        return rc;
    all.render = o->config;
    base_identity_add(id, "scene-crc", "%08x", scene_crc);
    base_options_identify(pt_cli_options, &all, id);
    base_identity_add(id, "sampler-version", "%d", PT_SAMPLER_VERSION);
    base_identity_add(id, "rr-depth", "%d", i->rr_depth);
    base_identity_add(id, "clamp", "%g", (double)i->max_component);
    base_identity_add(id, "criterion", "%s %s", t ? t->id : "none", t ? t->version : "");
    base_identity_add(id, "plugin-and-mask-crc", "%08x", judging_crc);
    return base_identity_check(id, err);
}

/* --- render --------------------------------------------------------------------------------------------------------- */

int pt_open_render(struct pt_cli *cli, struct job *job, struct base_log *log, struct pt_open *o, struct base_err *err)
{
    const int records = cli->action == PT_CLI_SEQUENCE;
    struct pt_render_config *c = &o->config;
    int rc;
    c->job = job_rank(job) == 0 ? job : NULL;
    if (c->crop[2] > c->width || c->crop[3] > c->height)
        return base_fail(err, BASE_EINVAL, "--crop %d,%d,%d,%d: the image has %dx%d pixels", c->crop[0], c->crop[1],
                         c->crop[2], c->crop[3], c->width, c->height);
    o->params = &cli->params;
    rc = open_denoiser(cli, o, err);
    if (!rc && (cli->criterion || !(records || c->uniform)))
        rc = open_criterion(cli, log, o, err);
    if (!rc && cli->shot.table)
        rc = base_inputs_add(&o->judging, cli->shot.table, err);
    if (!rc && !records && job_rank(job) == 0) /* the others write nothing */
        rc = check_outputs(cli, o, err);
    if (!rc && (cli->checkpoint.path || job))
        rc = identify(cli, o, err);
    return rc || records ? rc : pt_render_create(c, o->scene, o->kernel, o->threads, o->criterion, &o->render, err);
}

void pt_open_release(struct pt_open *o)
{
    pt_render_destroy(o->render);
    lull_host_close(o->criterion);
    pt_mask_release(&o->mask);
    pt_scene_destroy(o->scene);
    base_threads_destroy(o->threads);
    base_inputs_release(&o->scene_files);
    base_inputs_release(&o->judging);
    base_identity_release(&o->identity);
}
