#include "worker.h"

#include "actions.h"
#include "agree.h"
#include "base/interrupt.h"
#include "render/farm.h"
#include "setup.h"

int pt_worker_run(struct pt_session *s, struct base_err *err)
{
    struct pt_render_config config;
    base_interrupt_ignore();
    if (s->cli.action != PT_CLI_RENDER && s->cli.action != PT_CLI_QUOTE && s->cli.action != PT_CLI_SEQUENCE)
        return 0; /* rank 0 does it alone */
    int rc = pt_session_open(s, err);
    if (!rc)
        rc = s->cli.action == PT_CLI_SEQUENCE ? pt_action_open_sequence(s, &config, err) : pt_setup_render(s, err);
    if (!rc)
        rc = pt_agree_handshake(s, err);
    struct pt_farm_tools tools = {.maker = {s->scene, s->kernel, NULL}};
    if (!rc && s->render) {
        tools.criterion = s->criterion;
        tools.frame = s->render->frame;
        tools.film = &s->render->film;
    }
    return rc ? rc : pt_farm_serve(s->job, s->threads, &tools, err);
}
