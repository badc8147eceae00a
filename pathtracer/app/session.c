#include "session.h"

#include "base/interrupt.h"
#include "pbrt/load.h"

static int load_scene(struct pt_session *s, struct base_err *err)
{
    struct pt_load_options options = {.strict = s->cli.strict,
                                      .width = s->cli.width,
                                      .height = s->cli.height,
                                      .view = s->cli.view,
                                      .light_selection = s->cli.light_selection,
                                      .forced = s->cli.all_effects ? PT_FX_ALL : 0,
                                      .inputs = &s->scene_files,
                                      .log = &s->log};
    int rc = pt_scene_load(s->cli.scene, &options, &s->scene, &s->defaults, err);
    if (rc)
        return rc;
    s->kernel = pt_kernel_select(s->scene->effects, NULL, &s->kernel_name);
    return 0;
}

/* Threads and scene. */
int pt_session_open(struct pt_session *s, struct base_err *err)
{
    s->threads = base_threads_create(s->cli.threads > 0 ? s->cli.threads : job_threads(s->job), err);
    if (!s->threads)
        return BASE_ENOMEM;
    int rc = load_scene(s, err);
    if (rc == BASE_EIO)
        rc = err->code = BASE_EINVAL; /* the scene and its files are inputs */
    return rc;
}

void pt_session_release(struct pt_session *s)
{
    pt_quote_destroy(s->quote);
    pt_render_destroy(s->render);
    lull_host_close(s->criterion);
    pt_mask_release(&s->mask);
    pt_scene_destroy(s->scene);
    base_threads_destroy(s->threads);
    base_inputs_release(&s->scene_files);
    base_inputs_release(&s->judging);
    pt_cli_release(&s->cli);
}

int pt_interrupted(void *data)
{
    (void)data;
    return base_interrupted != 0;
}
