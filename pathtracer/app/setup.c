#include "setup.h"

#include <stdio.h>
#include <string.h>

#include "agree.h"
#include "base/files.h"
#include "base/inputs.h"
#include "base/outputs.h"
#include "render/host_find.h"
#include "render/output.h"

/* The criterion when none is named. */
static const char DEFAULT_CRITERION[] = "observer";

void pt_setup_override(const struct pt_cli *cli, struct pt_integrator *i)
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

int pt_setup_config(const struct pt_session *s, struct pt_render_config *config, struct base_err *err)
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
        .job = job_rank(s->job) == 0 ? s->job : NULL,
    };
    memcpy(config->crop, cli->has_crop ? cli->crop : s->defaults.crop, sizeof config->crop);
    pt_setup_override(cli, &config->integrator);
    if (config->crop[2] > config->width || config->crop[3] > config->height)
        return base_fail(err, BASE_EINVAL, "--crop %d,%d,%d,%d: the image has %dx%d pixels", config->crop[0],
                         config->crop[1], config->crop[2], config->crop[3], config->width, config->height);
    return 0;
}

int pt_setup_criterion(struct pt_session *s, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    const char *spec = cli->criterion ? cli->criterion : DEFAULT_CRITERION;
    if (!cli->criterion && cli->spp > 0)
        return 0;
    const struct lull_criterion *table;
    int rc = pt_criterion_find(spec, &s->judging, &s->log, &table, err);
    if (!rc)
        rc = pt_criterion_create(table, cli->params, cli->param_count, s->threads, &s->log, &s->criterion, err);
    if (rc || !cli->mask)
        return rc;
    rc = pt_mask_read(cli->mask, s->defaults.width, s->defaults.height, &s->mask, err);
    if (!rc)
        rc = base_inputs_add(&s->judging, cli->mask, err);
    return rc;
}

/* A parameter may name a file: a model. */
static int protect_parameters(const struct pt_cli *cli, struct base_err *err)
{
    struct base_inputs named = BASE_INPUTS_EMPTY;
    int rc = 0;
    for (uint32_t i = 0; i < cli->param_count && !rc; i++)
        if (base_file_check_input(cli->params[i].value, NULL) == 0)
            rc = base_inputs_add(&named, cli->params[i].value, err);
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &named, err);
    base_inputs_release(&named);
    return rc;
}

/* Outputs that would overwrite what the image is made from, or each other, are found out before the work. */
static int check_outputs(struct pt_session *s, struct base_err *err)
{
    struct pt_cli *cli = &s->cli;
    int rc = 0;
    if (!cli->quote && !cli->output && !cli->preview && !cli->report && cli->stop_map_count == 0) {
        const char *name = base_file_name(cli->scene), *dot = strrchr(name, '.');
        int n = dot ? (int)(dot - name) : (int)strlen(name);
        if (n > (int)sizeof s->default_output - 8)
            return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", cli->scene);
        snprintf(s->default_output, sizeof s->default_output, "%.*s.exr", n, name);
        cli->output = s->default_output;
        rc = base_outputs_add(&cli->outputs, "output", cli->output, err);
        if (!rc && !pt_output_is_ours(cli->output)) /* nobody asked for this name */
            rc = base_fail(err, BASE_EINVAL, "%s: another program's image would be replaced; -o FILE.exr names the output",
                           cli->output);
    }
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &s->scene_files, err);
    if (!rc)
        rc = base_outputs_protect(&cli->outputs, &s->judging, err);
    return rc ? rc : protect_parameters(cli, err);
}

/* The render with its criterion, as the command line says. */
int pt_setup_render(struct pt_session *s, struct base_err *err)
{
    struct pt_render_config config;
    int rc = pt_setup_config(s, &config, err);
    if (!rc)
        rc = pt_setup_criterion(s, err);
    config.mask = s->mask.grey ? &s->mask : NULL;
    if (!rc && job_rank(s->job) == 0) /* the others write nothing */
        rc = check_outputs(s, err);
    if (!rc)
        rc = pt_agree_settings(s, &config, err);
    return rc ? rc : pt_render_create(&config, s->scene, s->kernel, s->threads, s->criterion, &s->render, err);
}
