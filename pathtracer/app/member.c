#include "member.h"

#include "actions.h"
#include "agree.h"
#include "base/interrupt.h"
#include "render/crew_member.h"
#include "setup.h"

static struct pt_crew_tools tools_of(const struct pt_session *s)
{
    return (struct pt_crew_tools){s->threads, {s->scene, s->kernel, NULL}, s->render};
}

/* Makes everything as rank 0 makes it, and tells it what that is. */
static int join_crew(struct pt_session *s, struct base_err *err)
{
    char text[PT_AGREE_JOB];
    struct pt_render_config config;
    int rc = pt_session_open(s, err);
    if (!rc)
        rc = s->cli.action == PT_CLI_SEQUENCE ? pt_action_open_sequence(s, &config, err) : pt_setup_render(s, err);
    if (!rc)
        rc = pt_agree_job(s, text, sizeof text, err);
    const struct pt_crew_tools tools = tools_of(s);
    return rc ? rc : pt_crew_member_join(s->peers, &tools, text, err);
}

int pt_member_serve(struct pt_session *s, int rc, struct base_err *err)
{
    struct base_err unheard = {0};
    int renders = s->cli.action == PT_CLI_RENDER || s->cli.action == PT_CLI_QUOTE || s->cli.action == PT_CLI_SEQUENCE;
    base_interrupt_ignore();
    if (!rc && renders)
        rc = join_crew(s, err);
    if (rc)
        pt_crew_member_fail(s->peers, err, &unheard);
    const struct pt_crew_tools tools = tools_of(s);
    return pt_crew_member_serve(s->peers, rc || !renders ? NULL : &tools, &unheard);
}
