#include "open.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "base/files.h"
#include "pbrt/load.h"
#include "render/output.h"
#include "sample/sampler.h"

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

/* What command line and frame put over what the scene says. */
static void configure(struct pt_open *o)
{
    const struct pt_shot_frame *f = o->frame;
    struct pt_render_config *c = &o->config;
    *c = o->cli->render;
    c->width = o->found.width;
    c->height = o->found.height;
    if (!o->cli->has_crop)
        memcpy(c->crop, o->found.crop, sizeof c->crop);
    c->integrator = o->found.integrator;
    override(&o->cli->render.integrator, &c->integrator);
    c->integrator.seed = f->seed;
    if (f->table) {
        c->uniform = 1;
        c->spp_min = c->spp_max = 1;
        for (size_t i = 0; i < f->table->block_count; i++)
            if (f->block_spp[i] > c->spp_max)
                c->spp_min = c->spp_max = f->block_spp[i];
    }
}

/* A scene may have been edited since the last frame. */
static int is_open(const struct pt_open *o, const struct pt_shot_frame *f)
{
    uint32_t crc;
    return o->scene && strcmp(o->scene_path, f->paths[PT_SCENE]) == 0 && memcmp(&o->view, &f->view, sizeof o->view) == 0 &&
           base_inputs_crc32(&o->scene_files, &crc, NULL) == 0 && crc == o->scene_crc;
}

static void close_scene(struct pt_open *o)
{
    pt_scene_destroy(o->scene);
    o->scene = NULL;
    base_inputs_release(&o->scene_files);
}

static int load(struct pt_open *o, const struct pt_shot_frame *f, struct base_err *err)
{
    struct pt_load_options options = o->cli->load;
    close_scene(o);
    options.view = o->view = f->view;
    options.inputs = &o->scene_files;
    options.log = o->log;
    snprintf(o->scene_path, sizeof o->scene_path, "%s", f->paths[PT_SCENE]);
    int rc = pt_scene_load(f->paths[PT_SCENE], &options, &o->scene, &o->found, err);
    if (!rc && f->number >= 0)
        rc = base_inputs_crc32(&o->scene_files, &o->scene_crc, err);
    if (rc)
        return rc == BASE_EIO ? (err->code = BASE_EINVAL) : rc; /* the scene and its files are inputs */
    o->kernel = pt_kernel_select(o->scene->effects, NULL, &o->kernel_name);
    note_slow_load(o->log, f->paths[PT_SCENE], &o->scene->stats);
    return 0;
}

int pt_open_init(struct pt_open *o, const struct pt_cli *cli, struct job *job, struct base_log *log, struct base_err *err)
{
    *o = (struct pt_open){.cli = cli, .log = log, .scene_files = BASE_INPUTS_EMPTY, .judging = BASE_INPUTS_EMPTY};
    o->threads = base_threads_create(cli->threads > 0 ? cli->threads : job_threads(job), err);
    return o->threads ? 0 : BASE_ENOMEM;
}

int pt_open_scene(struct pt_open *o, const struct pt_shot_frame *f, struct base_err *err)
{
    o->frame = f;
    o->start_s = base_clock_wall_s();
    int rc = is_open(o, f) ? 0 : load(o, f, err);
    if (!rc)
        configure(o);
    o->load_s = base_clock_wall_s() - o->start_s;
    return rc;
}

static const char *parameter(const struct pt_cli_params *params, const char *key)
{
    const char *value = NULL;
    for (uint32_t i = 0; i < params->count; i++)
        if (strcmp(params->list[i].key, key) == 0)
            value = params->list[i].value;
    return value;
}

/* A criterion that can judge either picture judges the one that is kept, unless a parameter says otherwise. */
static int add_picture(struct pt_open *o, const struct lull_criterion *table, struct base_err *err)
{
    struct pt_cli_params *params = &o->params;
    const struct lull_param *picture = NULL;
    lull_host_parameter(table, "picture", params->list, params->count, &picture);
    if (o->picture != PT_PICTURE_DENOISED || !picture || parameter(params, "picture"))
        return 0;
    if (params->count == PT_CLI_MAX_PARAMS)
        return base_fail(err, BASE_EINVAL, "more than %d parameters", PT_CLI_MAX_PARAMS);
    params->list[params->count++] = (struct lull_pair){"picture", "denoised"};
    return 0;
}

/* A denoiser that is not there is found out before the work. */
static int open_denoiser(struct pt_open *o, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    o->picture = o->cli->picture;
    o->denoiser = parameter(&o->params, "library");
    o->config.planes |= pt_denoised_planes(o->picture);
    int32_t code = o->picture == PT_PICTURE_NOISY ? LULL_OK : lull_host_denoiser(o->denoiser, &e);
    return code == LULL_OK ? 0 : base_fail(err, BASE_EINVAL, "--denoise: %s", e.message);
}

int pt_open_find_criterion(struct pt_open *o, const struct lull_criterion **table, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    const char *usual = cli->picture == PT_PICTURE_NOISY ? PT_OPEN_NOISY_CRITERION : "denoised";
    return pt_criterion_find(cli->criterion ? cli->criterion : usual, &o->judging, o->log, table, err);
}

static int open_criterion(struct pt_open *o, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    const struct lull_criterion *table;
    int rc = pt_open_find_criterion(o, &table, err);
    if (!rc)
        rc = add_picture(o, table, err);
    if (!rc)
        rc = pt_criterion_create(table, o->params.list, o->params.count, o->threads, o->log, &o->criterion, err);
    if (rc || !cli->mask)
        return rc;
    rc = pt_mask_read(cli->mask, o->config.width, o->config.height, &o->mask, err);
    if (!rc)
        rc = base_inputs_add(&o->judging, cli->mask, err);
    o->config.mask = &o->mask;
    return rc;
}

/* A parameter may name a file: a model. */
static int protect_parameters(const struct pt_open *o, const struct base_outputs *outputs, struct base_err *err)
{
    struct base_inputs named = BASE_INPUTS_EMPTY;
    int rc = 0;
    for (uint32_t i = 0; i < o->params.count && !rc; i++)
        if (base_file_check_input(o->params.list[i].value, NULL) == 0)
            rc = base_inputs_add(&named, o->params.list[i].value, err);
    if (!rc)
        rc = base_outputs_protect(outputs, &named, err);
    base_inputs_release(&named);
    return rc;
}

/* Outputs that would overwrite what the image is made from, or each other, are found out before the work. */
static int check_outputs(const struct pt_open *o, struct base_err *err)
{
    struct base_outputs outputs = o->frame->outputs;
    const char *image = o->cli->paths[PT_OUTPUT] ? NULL : o->frame->paths[PT_OUTPUT]; /* nobody asked for this name */
    int rc = base_outputs_add(&outputs, "output", image, err);
    if (!rc && image && !pt_output_is_ours(image))
        rc = base_fail(err, BASE_EINVAL, "%s: another program's image would be replaced; -o FILE.exr names the output",
                       image);
    if (!rc)
        rc = base_outputs_protect(&outputs, &o->scene_files, err);
    if (!rc)
        rc = base_outputs_protect(&outputs, &o->judging, err);
    return rc ? rc : protect_parameters(o, &outputs, err);
}

/* Everything that decides the bytes of the image, and nothing else: the options, with the scene's own settings where they
 * say nothing, and what was read. A criterion's model is in its saved state. */
static int identify(struct pt_open *o, struct base_err *err)
{
    struct base_identity *id = &o->identity;
    struct pt_cli all = *o->cli;
    const struct pt_integrator *i = &o->config.integrator;
    const struct lull_criterion *t = o->criterion ? lull_host_table(o->criterion) : NULL;
    uint32_t scene_crc = 0, judging_crc = 0;
    int rc = base_inputs_crc32(&o->scene_files, &scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&o->judging, &judging_crc, err);
    if (rc)
        return rc;
    all.load.view = o->view;
    all.params = o->params;
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

int pt_open_frame(struct pt_open *o, struct job *job, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    const int records = cli->action == PT_CLI_SEQUENCE, looks = cli->sequence.planes && !cli->sequence.levels;
    struct pt_render_config *c = &o->config;
    c->job = job_rank(job) == 0 ? job : NULL;
    if (c->crop[2] > c->width || c->crop[3] > c->height)
        return base_fail(err, BASE_EINVAL, "--crop %d,%d,%d,%d: the image has %dx%d pixels", c->crop[0], c->crop[1],
                         c->crop[2], c->crop[3], c->width, c->height);
    o->params = cli->params;
    int rc = open_denoiser(o, err);
    if (!rc && (cli->criterion || looks || !(records || c->uniform)))
        rc = open_criterion(o, err);
    if (!rc && cli->shot.table)
        rc = base_inputs_add(&o->judging, cli->shot.table, err);
    if (!rc && !records && job_rank(job) == 0) /* the others write nothing */
        rc = check_outputs(o, err);
    if (!rc && (o->frame->paths[PT_CHECKPOINT] || job))
        rc = identify(o, err);
    return rc || records ? rc : pt_render_create(c, o->scene, o->kernel, o->threads, o->criterion, &o->render, err);
}

void pt_open_end_frame(struct pt_open *o)
{
    pt_render_destroy(o->render);
    o->render = NULL;
    lull_host_close(o->criterion);
    o->criterion = NULL;
    pt_mask_release(&o->mask);
    base_inputs_release(&o->judging);
    base_identity_release(&o->identity);
}

void pt_open_release(struct pt_open *o)
{
    pt_open_end_frame(o);
    close_scene(o);
    base_threads_destroy(o->threads);
}
