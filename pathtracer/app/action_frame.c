#include "actions.h"

#include <stdio.h>

#include "agree.h"
#include "base/interrupt.h"
#include "render/farm.h"

/* What the scene asks for, and what decides when a block of it is done. */
static int explain(struct pt_open *o, struct base_err *err)
{
    const struct lull_criterion *table;
    int rc = pt_open_find_criterion(o, &table, err);
    if (rc)
        return rc;
    pt_action_explain(o->scene, &o->config, o->frame->paths[PT_SCENE]);
    printf("criterion: ");
    pt_criterion_describe(table, stdout);
    return 0;
}

static int act(struct pt_open *o, int *status, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    switch (cli->action) {
    case PT_CLI_EXPLAIN: return explain(o, err);
    case PT_CLI_DEBUG_PATH: return pt_action_debug_path(o->scene, &o->config, cli->debug, err);
    case PT_CLI_QUOTE: return pt_action_quote(o, status, err);
    case PT_CLI_SEQUENCE: return pt_action_record(o, status, err);
    default: return pt_action_image(o, status, err);
    }
}

int pt_action_frame(struct pt_open *o, const struct pt_shot_frame *frame, struct job *job, int *status, struct base_err *err)
{
    const int works = job_rank(job) > 0, samples = pt_cli_samples(o->cli);
    int rc = pt_open_scene(o, frame, err);
    if (!rc && samples)
        rc = pt_open_frame(o, job, err);
    if (!rc && !works) /* before that there is nothing to save, and a criterion may never return from being loaded */
        base_interrupt_catch();
    if (!rc && samples)
        rc = pt_agree_handshake(o, job, err);
    if (!rc)
        rc = works ? pt_farm_serve(job, o->threads, &(struct pt_sampler_context){o->scene, o->kernel, NULL}, err)
                   : act(o, status, err);
    pt_open_end_frame(o);
    return rc;
}
