/* Which options of `lull-render` go together, and what follows from those that are not given. */
#include "app/cli.h"

#include <stdio.h>

enum { USUAL_SPP_MIN = 16, USUAL_SPP_MAX = 10000 };

int pt_cli_samples(const struct pt_cli *cli)
{
    return cli->action == PT_CLI_RENDER || cli->action == PT_CLI_QUOTE || cli->action == PT_CLI_SEQUENCE;
}

int pt_cli_writes_image(const struct pt_cli *cli)
{
    const char *const *p = cli->paths;
    return p[PT_OUTPUT] || p[PT_PREVIEW] || p[PT_REPORT] || p[PT_PAGE] || p[PT_STOP_MAPS];
}

int pt_cli_is_shot(const struct pt_cli *cli) { return cli->shot.frames || cli->shot.camera_path; }

#define WRITES_NO_IMAGE " writes no image: leave out -o, --preview, --report, --html and --stop-map"
#define SHOWS_NO_IMAGE " shows no image: leave out --display-server"

/* Something that cannot be meant. */
struct fault {
    int is_so;
    const char *text;
};

/* The first of several faults, which end with one without text. */
static int refuse(const struct fault *faults, struct base_err *err)
{
    for (const struct fault *f = faults; f->text; f++)
        if (f->is_so)
            return base_fail(err, BASE_EINVAL, "%s", f->text);
    return 0;
}

static int check_shot(const struct pt_cli *cli, struct base_err *err)
{
    const char *const *p = cli->paths;
    const struct pt_shot_plan *s = &cli->shot;
    const struct pt_render_config *r = &cli->render;
    const int shot = pt_cli_is_shot(cli), stops = cli->spp > 0 || r->max_seam > 0;
    return refuse(
        (const struct fault[]){
            {!shot && (s->plan || s->table || s->same_seed || s->plan_every),
             "--plan-shot, --plan-every, --shot-table and --frame-seed belong to --frames or --camera-path"},
            {shot && (cli->action != PT_CLI_RENDER || cli->quote || cli->sequence.directory),
             "--frames goes with none of --quote, --sequence, --explain and --debug-path"},
            {s->camera_path && cli->load.view.has_look_at, "--camera-path and --look-at are two cameras: leave out one"},
            {s->plan_every && !s->plan, "--plan-every belongs to --plan-shot"},
            {s->plan && pt_cli_writes_image(cli), "--plan-shot" WRITES_NO_IMAGE},
            {s->plan && cli->display, "--plan-shot" SHOWS_NO_IMAGE},
            {s->plan && (p[PT_CHECKPOINT] || s->table), "--plan-shot goes with neither --checkpoint nor --shot-table"},
            {s->plan && (stops || r->time_budget_s > 0),
             "--plan-shot goes with neither --spp, --max-seam nor --time-budget"},
            {shot && !s->plan && !p[PT_OUTPUT], "--frames needs -o OUT_%04d.exr"},
            {s->table && (cli->criterion || cli->params.count > 0 || cli->mask || stops || r->spp_min > 0 || r->spp_max > 0),
             "--shot-table says how many samples: leave out everything else that does"},
            {0, NULL}},
        err);
}

static int check_samples(const struct pt_cli *cli, struct base_err *err)
{
    const struct pt_render_config *r = &cli->render;
    const uint64_t spp_min = r->spp_min ? r->spp_min : USUAL_SPP_MIN, spp_max = r->spp_max ? r->spp_max : USUAL_SPP_MAX;
    if (cli->spp > 0 && (r->spp_min > 0 || r->spp_max > 0))
        return base_fail(err, BASE_EINVAL, "--spp takes the same samples everywhere: leave out --spp-min and --spp-max");
    if (cli->spp == 0 && spp_min > spp_max)
        return base_fail(err, BASE_EINVAL, "--spp-min %llu is above --spp-max %llu", (unsigned long long)spp_min,
                         (unsigned long long)spp_max);
    return 0;
}

/* What images, recordings and quotes have to do with each other. */
static int check_actions(const struct pt_cli *cli, struct base_err *err)
{
    const char *const *p = cli->paths;
    const struct pt_sequence_config *q = &cli->sequence;
    const struct pt_render_config *r = &cli->render;
    const int records = q->directory != NULL, looks = cli->action != PT_CLI_RENDER, writes = pt_cli_writes_image(cli);
    char masked[512];
    snprintf(masked, sizeof masked, "--mask %s: --spp takes the same samples everywhere", cli->mask ? cli->mask : "");
    return refuse(
        (const struct fault[]){
            {cli->resume && !p[PT_CHECKPOINT], "--resume needs --checkpoint FILE"},
            {records && (cli->spp > 0 || p[PT_CHECKPOINT] || cli->has_crop || cli->mask),
             "--sequence goes with neither --spp, --checkpoint, --crop nor --mask"},
            {records && writes, "--sequence" WRITES_NO_IMAGE},
            {records && cli->display, "--sequence" SHOWS_NO_IMAGE},
            {records && cli->picture != PT_PICTURE_NOISY, "--sequence records noisy blocks: leave out --denoise"},
            {records && looks, "--sequence records blocks: leave out what only looks at the scene or a path"},
            {!records && (q->levels || q->blocks || q->reference_spp > 0 || q->name || q->planes || q->past_stops),
             "--levels, --planes, --past-stops, --blocks, --reference-spp and --name belong to --sequence DIR"},
            {q->planes && q->blocks, "--planes records whole frames: leave out --blocks"},
            {q->planes && (r->time_budget_s > 0 || r->max_check_overhead > 0),
             "--planes goes with neither --time-budget nor --max-check-overhead: looks would hang on the clock"},
            {q->past_stops && (!q->planes || q->levels),
             "--past-stops belongs to --planes without --levels, where blocks stop"},
            {cli->live && !p[PT_PREVIEW] && !p[PT_REPORT] && !p[PT_STOP_MAPS],
             "--live belongs to --report, --stop-map and --preview"},
            {p[PT_QUOTED] && !p[PT_PAGE], "--quoted belongs to --html"},
            {cli->mask && cli->spp > 0, masked},
            {cli->quote && (looks || records), "--quote goes with none of --explain, --debug-path and --sequence"},
            {cli->quote && writes, "--quote" WRITES_NO_IMAGE},
            {cli->quote && cli->display, "--quote" SHOWS_NO_IMAGE},
            {cli->quote && (cli->resume || r->time_budget_s > 0),
             "--quote goes with neither --resume nor --time-budget (--quote-pilot bounds it)"},
            {cli->quote && r->max_seam > 0, "--quote does not know what --max-seam re-opens: leave it out"},
            {!cli->quote && ((r->pilot_spp > 0 && !cli->shot.plan) || cli->quote_map || cli->json),
             "--quote-pilot, --quote-map and --json belong to --quote"},
            {0, NULL}},
        err);
}

static void fill_in(struct pt_cli *cli)
{
    struct pt_render_config *r = &cli->render;
    const int pilots = cli->quote || cli->shot.plan;
    r->uniform = cli->spp > 0;
    if (!r->spp_min)
        r->spp_min = r->uniform ? cli->spp : USUAL_SPP_MIN;
    if (!r->spp_max)
        r->spp_max = r->uniform ? cli->spp : USUAL_SPP_MAX;
    if (!cli->shot.plan_every)
        cli->shot.plan_every = 8;
    if (pilots && !r->pilot_spp)
        r->pilot_spp = 128;
    if (pilots && !(r->pilot_s > 0))
        r->pilot_s = 30.0;
    if (cli->quote || cli->sequence.directory)
        cli->action = cli->quote ? PT_CLI_QUOTE : PT_CLI_SEQUENCE;
    cli->load.forced = cli->all_effects ? PT_FX_ALL : 0;
}

int pt_cli_check(struct pt_cli *cli, struct base_err *err)
{
    if (cli->action == PT_CLI_LIST_CRITERIA)
        return 0;
    if (!cli->paths[PT_SCENE])
        return base_fail(err, BASE_EINVAL, "a scene file is needed (--help says more)");
    if (check_shot(cli, err) != 0 || check_samples(cli, err) != 0 || check_actions(cli, err) != 0)
        return BASE_EINVAL;
    if (cli->params.count > 0 && (cli->spp > 0 || cli->sequence.directory) && !cli->criterion)
        return base_fail(err, BASE_EINVAL, "-p %s=%s: no criterion is used", cli->params.list[0].key,
                         cli->params.list[0].value);
    fill_in(cli);
    return 0;
}
