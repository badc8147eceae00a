#include "actions.h"

#include <stdio.h>

#include "render/checkpoint.h"
#include "watch.h"

static int print_quote(const struct pt_open *o, struct pt_quote *quote, int was_interrupted, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    const struct pt_quote_info info = {o->frame->paths[PT_SCENE], o->scene->stats.bytes, o->load_s, was_interrupted};
    int rc = 0;
    if (cli->json)
        rc = pt_quote_json(stdout, quote, o->render, &info, err);
    else
        pt_quote_text(stdout, quote, o->render, &info);
    return rc || !cli->quote_map ? rc : pt_quote_map(cli->quote_map, quote, o->render, err);
}

static int open_quote(const struct pt_open *o, struct pt_quote **out, struct base_err *err)
{
    const struct lull_criterion *noisy = NULL;
    int rc = o->criterion && o->picture != PT_PICTURE_NOISY
                 ? pt_criterion_find(PT_OPEN_NOISY_CRITERION, NULL, o->log, &noisy, err)
                 : 0;
    return rc ? rc : pt_quote_create(o->render, noisy, out, err);
}

/* When the pilot is over the checkpoint is the render's, whoever goes on with it. */
int pt_action_pilot(struct pt_open *o, struct pt_quote **quote, int *status, struct base_err *err)
{
    const char *checkpoint = o->frame->paths[PT_CHECKPOINT];
    enum pt_render_outcome outcome;
    struct pt_watch watch;
    int rc = open_quote(o, quote, err);
    if (!rc)
        rc = pt_watch_init(&watch, o, NULL, err);
    if (rc)
        return rc;
    watch.hooks.quote = (*quote)->quote;
    rc = pt_render_run(o->render, &watch.hooks, &outcome, err);
    pt_watch_end(&watch);
    *status = pt_action_status(outcome);
    if (!rc && checkpoint && outcome == PT_RENDER_PILOT)
        rc = pt_checkpoint_save(checkpoint, o->render, &o->identity, err);
    if (!rc && outcome != PT_RENDER_LOST)
        rc = pt_quote_finish(*quote, o->render, err);
    return rc;
}

int pt_action_quote(struct pt_open *o, int *status, struct base_err *err)
{
    struct pt_quote *quote = NULL;
    int rc = pt_action_pilot(o, &quote, status, err);
    if (!rc && *status != PT_EXIT_BAD_INPUT) /* a worker that was lost */
        rc = print_quote(o, quote, *status == PT_EXIT_INTERRUPTED, err);
    pt_quote_destroy(quote);
    return rc;
}
