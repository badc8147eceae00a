#include "actions.h"
#include "watch.h"

static int crc_of(const char *path, uint32_t *crc, struct base_err *err)
{
    struct base_inputs one = BASE_INPUTS_EMPTY;
    int rc = base_inputs_add(&one, path, err);
    if (!rc)
        rc = base_inputs_crc32(&one, crc, err);
    base_inputs_release(&one);
    return rc;
}

int pt_action_record(struct pt_open *o, int *status, struct base_err *err)
{
    struct pt_sequence_config config = o->cli->sequence;
    struct pt_watch watch;
    int was_interrupted = 0;
    config.scene_path = o->frame->paths[PT_SCENE];
    config.view = o->view;
    config.render = o->config;
    int rc = crc_of(o->frame->paths[PT_SCENE], &config.scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&o->scene_files, &config.inputs_crc, err);
    if (rc)
        return rc;
    pt_watch_init(&watch, o, NULL);
    const struct pt_render_hooks hooks = pt_watch_hooks(&watch);
    rc = pt_sequence_record(&config, o->scene, o->kernel, o->threads, o->criterion, &hooks, &was_interrupted, err);
    base_log_clear(o->log);
    *status = was_interrupted ? PT_EXIT_INTERRUPTED : 0;
    return rc;
}
