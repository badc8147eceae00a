/* Which options of `lull-render` go together, and what follows from those that are not given. */
#include "app/cli.h"

int pt_cli_samples(const struct pt_cli *cli)
{
    return cli->action == PT_CLI_RENDER || cli->action == PT_CLI_QUOTE || cli->action == PT_CLI_SEQUENCE;
}

int pt_cli_writes_image(const struct pt_cli *cli)
{
    const char *const *p = cli->paths;
    return p[PT_OUTPUT] || p[PT_PREVIEW] || p[PT_REPORT] || p[PT_PAGE] || p[PT_STOP_MAPS];
}

/* What goes with an image alone. */
static int check_no_image(const struct pt_cli *cli, const char *option, struct base_err *err)
{
    if (pt_cli_writes_image(cli))
        return base_fail(err, BASE_EINVAL, "%s writes no image: leave out -o, --preview, --report, --html and --stop-map",
                         option);
    if (cli->display)
        return base_fail(err, BASE_EINVAL, "%s shows no image: leave out --display-server", option);
    return 0;
}

static void set_pilot(struct pt_render_config *r)
{
    if (r->pilot_spp == 0)
        r->pilot_spp = 128;
    if (r->pilot_s <= 0)
        r->pilot_s = 30.0;
}

static int check_quote(struct pt_cli *cli, struct base_err *err)
{
    struct pt_render_config *r = &cli->render;
    if (cli->action != PT_CLI_RENDER)
        return base_fail(err, BASE_EINVAL, "--quote goes with none of --explain, --debug-path and --sequence");
    if (check_no_image(cli, "--quote", err) != 0)
        return BASE_EINVAL;
    if (cli->resume || r->time_budget_s > 0)
        return base_fail(err, BASE_EINVAL, "--quote goes with neither --resume nor --time-budget (--quote-pilot bounds it)");
    if (r->max_seam > 0)
        return base_fail(err, BASE_EINVAL, "--quote does not know what --max-seam re-opens: leave it out");
    set_pilot(r);
    cli->action = PT_CLI_QUOTE;
    return 0;
}

static int check_no_quote(const struct pt_cli *cli, struct base_err *err)
{
    if ((cli->render.pilot_spp > 0 && !cli->shot.plan) || cli->quote_map || cli->json)
        return base_fail(err, BASE_EINVAL, "--quote-pilot, --quote-map and --json belong to --quote");
    return 0;
}

static int check_sequence(struct pt_cli *cli, struct base_err *err)
{
    if (cli->spp > 0 || cli->paths[PT_CHECKPOINT] || cli->has_crop || cli->mask)
        return base_fail(err, BASE_EINVAL, "--sequence goes with neither --spp, --checkpoint, --crop nor --mask");
    if (check_no_image(cli, "--sequence", err) != 0)
        return BASE_EINVAL;
    if (cli->picture != PT_PICTURE_NOISY)
        return base_fail(err, BASE_EINVAL, "--sequence records noisy blocks: leave out --denoise");
    if (cli->action != PT_CLI_RENDER)
        return base_fail(err, BASE_EINVAL, "--sequence records blocks: leave out what only looks at the scene or a path");
    cli->action = PT_CLI_SEQUENCE;
    return 0;
}

static int check_no_sequence(const struct pt_cli *cli, struct base_err *err)
{
    const struct pt_sequence_config *q = &cli->sequence;
    if (q->levels || q->blocks || q->reference_spp > 0 || q->name)
        return base_fail(err, BASE_EINVAL, "--levels, --blocks, --reference-spp and --name belong to --sequence DIR");
    return 0;
}

static int check_samples(struct pt_cli *cli, struct base_err *err)
{
    struct pt_render_config *r = &cli->render;
    if (cli->spp > 0 && (r->spp_min > 0 || r->spp_max > 0))
        return base_fail(err, BASE_EINVAL, "--spp takes the same samples everywhere: leave out --spp-min and --spp-max");
    r->uniform = cli->spp > 0;
    if (!r->spp_min)
        r->spp_min = r->uniform ? cli->spp : 16;
    if (!r->spp_max)
        r->spp_max = r->uniform ? cli->spp : 10000;
    if (r->spp_min > r->spp_max)
        return base_fail(err, BASE_EINVAL, "--spp-min %llu is above --spp-max %llu", (unsigned long long)r->spp_min,
                         (unsigned long long)r->spp_max);
    return 0;
}

int pt_cli_is_shot(const struct pt_cli *cli) { return cli->shot.frames || cli->shot.camera_path; }

static int check_plan(struct pt_cli *cli, struct base_err *err)
{
    struct pt_render_config *r = &cli->render;
    if (check_no_image(cli, "--plan-shot", err) != 0)
        return BASE_EINVAL;
    if (cli->paths[PT_CHECKPOINT] || cli->shot.table)
        return base_fail(err, BASE_EINVAL, "--plan-shot goes with neither --checkpoint nor --shot-table");
    if (cli->spp > 0 || r->max_seam > 0 || r->time_budget_s > 0)
        return base_fail(err, BASE_EINVAL, "--plan-shot goes with neither --spp, --max-seam nor --time-budget");
    set_pilot(r);
    return 0;
}

static int check_shot(struct pt_cli *cli, struct base_err *err)
{
    const struct pt_shot_plan *s = &cli->shot;
    const struct pt_render_config *r = &cli->render;
    if (!pt_cli_is_shot(cli))
        return !s->plan && !s->table && !s->same_seed && !s->plan_every
                   ? 0
                   : base_fail(err, BASE_EINVAL,
                               "--plan-shot, --plan-every, --shot-table and --frame-seed belong to "
                               "--frames or --camera-path");
    if (cli->action != PT_CLI_RENDER || cli->quote || cli->sequence.directory)
        return base_fail(err, BASE_EINVAL, "--frames goes with none of --quote, --sequence, --explain and --debug-path");
    if (s->camera_path && cli->load.view.has_look_at)
        return base_fail(err, BASE_EINVAL, "--camera-path and --look-at are two cameras: leave out one");
    if (s->plan_every > 0 && !s->plan)
        return base_fail(err, BASE_EINVAL, "--plan-every belongs to --plan-shot");
    cli->shot.plan_every = s->plan_every > 0 ? s->plan_every : 8;
    if (s->plan)
        return check_plan(cli, err);
    if (!cli->paths[PT_OUTPUT])
        return base_fail(err, BASE_EINVAL, "--frames needs -o OUT_%%04d.exr");
    if (s->table && (cli->criterion || cli->params.count > 0 || cli->mask || cli->spp > 0 || r->spp_min > 0 ||
                     r->spp_max > 0 || r->max_seam > 0))
        return base_fail(err, BASE_EINVAL, "--shot-table says how many samples: leave out everything else that does");
    return 0;
}

int pt_cli_check(struct pt_cli *cli, struct base_err *err)
{
    if (cli->action == PT_CLI_LIST_CRITERIA)
        return 0;
    if (!cli->paths[PT_SCENE])
        return base_fail(err, BASE_EINVAL, "a scene file is needed (--help says more)");
    if (check_shot(cli, err) != 0)
        return BASE_EINVAL;
    if (check_samples(cli, err) != 0)
        return BASE_EINVAL;
    if (cli->resume && !cli->paths[PT_CHECKPOINT])
        return base_fail(err, BASE_EINVAL, "--resume needs --checkpoint FILE");
    if (cli->sequence.directory ? check_sequence(cli, err) != 0 : check_no_sequence(cli, err) != 0)
        return BASE_EINVAL;
    if (cli->live && !cli->paths[PT_PREVIEW] && !cli->paths[PT_REPORT] && !cli->paths[PT_STOP_MAPS])
        return base_fail(err, BASE_EINVAL, "--live belongs to --report, --stop-map and --preview");
    if (cli->paths[PT_QUOTED] && !cli->paths[PT_PAGE])
        return base_fail(err, BASE_EINVAL, "--quoted belongs to --html");
    if (cli->mask && cli->spp > 0)
        return base_fail(err, BASE_EINVAL, "--mask %s: --spp takes the same samples everywhere", cli->mask);
    if (cli->quote ? check_quote(cli, err) != 0 : check_no_quote(cli, err) != 0)
        return BASE_EINVAL;
    if (cli->params.count > 0 && cli->spp > 0 && !cli->criterion)
        return base_fail(err, BASE_EINVAL, "-p %s=%s: no criterion is used", cli->params.list[0].key,
                         cli->params.list[0].value);
    cli->load.forced = cli->all_effects ? PT_FX_ALL : 0;
    return 0;
}
