#include "actions.h"

#include <stdio.h>

#include "base/clock.h"
#include "quote_output.h"
#include "render/checkpoint.h"

static void ask_quote(void *data, struct pt_render *render, const uint32_t *due, uint32_t count)
{
    struct pt_session *s = data;
    pt_quote_ask(s->quote, render, due, count);
}

/* The pilot is over: the checkpoint is the render's, whoever goes on with it. */
static int tell_quote(struct pt_session *s, double load_s, int was_interrupted, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    int rc = pt_quote_finish(s->quote, s->render, err);
    if (rc)
        return rc;
    struct pt_quote_info info = {.scene = cli->scene,
                                 .params = cli->params,
                                 .param_count = cli->param_count,
                                 .scene_bytes = s->scene->stats.bytes,
                                 .load_s = load_s,
                                 .interrupted = was_interrupted};
    if (cli->json)
        rc = pt_quote_json(stdout, s->quote, s->render, &info, err);
    else
        pt_quote_text(stdout, s->quote, s->render, &info);
    return rc || !cli->quote_map ? rc : pt_quote_map(cli->quote_map, s->quote, s->render, err);
}

int pt_action_quote(struct pt_session *s, int *status, struct base_err *err)
{
    enum pt_render_outcome outcome;
    double load_s = base_clock_wall_s() - s->start_s;
    int rc = pt_action_open_render(s, err);
    if (!rc)
        rc = pt_quote_create(s->render, s->criterion ? lull_host_table(s->criterion) : NULL, s->cli.params,
                             s->cli.param_count, &s->log, &s->quote, err);
    if (rc)
        return rc;
    struct pt_render_hooks hooks = {.slice = pt_action_after_slice,
                                    .judged = ask_quote,
                                    .interrupted = pt_interrupted,
                                    .suspend = pt_action_suspend,
                                    .log = &s->log,
                                    .data = s};
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
    rc = pt_render_run(s->render, &hooks, &outcome, err);
    base_log_clear(&s->log);
    if (!rc && s->cli.checkpoint && pt_action_status(outcome) == 0)
        rc = pt_checkpoint_save(s->cli.checkpoint, s->render, s->settings, err);
    if (!rc && outcome != PT_RENDER_LOST)
        rc = tell_quote(s, load_s, outcome == PT_RENDER_INTERRUPTED, err);
    *status = pt_action_status(outcome);
    return rc;
}
