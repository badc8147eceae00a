#include "actions.h"

#include "agree.h"
#include "render/sequence.h"
#include "setup.h"

/* What deals with the settings of a recording besides pt_sequence_record. */
int pt_action_open_sequence(struct pt_session *s, struct pt_render_config *config, struct base_err *err)
{
    int rc = pt_setup_config(s, config, err);
    if (!rc && s->cli.criterion)
        rc = pt_setup_criterion(s, err);
    return rc ? rc : pt_agree_settings(s, config, err);
}

int pt_action_sequence(struct pt_session *s, int *status, struct base_err *err)
{
    struct pt_sequence_config config = {.directory = s->cli.sequence,
                                        .levels = s->cli.levels,
                                        .blocks = s->cli.sequence_blocks,
                                        .reference_spp = s->cli.reference_spp,
                                        .scene_path = s->cli.scene,
                                        .name = s->cli.name,
                                        .view = s->cli.view};
    const struct pt_render_hooks hooks = {
        .slice = pt_action_after_slice, .interrupted = pt_interrupted, .log = &s->log, .data = s};
    int rc = pt_action_open_sequence(s, &config.render, err);
    if (!rc)
        rc = pt_agree_crc(s->cli.scene, &config.scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&s->scene_files, &config.inputs_crc, err);
    if (!rc)
        rc = pt_agree_handshake(s, err);
    if (rc)
        return rc;
    int was_interrupted = 0;
    rc = pt_sequence_record(&config, s->scene, s->kernel, s->threads, s->criterion, &hooks, &was_interrupted, err);
    base_log_clear(&s->log);
    *status = was_interrupted ? PT_EXIT_INTERRUPTED : 0;
    return rc;
}
