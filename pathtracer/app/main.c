#include <stdio.h>

#include "actions.h"
#include "base/clock.h"
#include "base/interrupt.h"
#include "explain.h"
#include "render/host_find.h"
#include "setup.h"
#include "worker.h"

static void explain(struct pt_session *s)
{
    struct pt_integrator integrator = s->defaults.integrator;
    pt_setup_override(&s->cli, &integrator);
    pt_explain(s->scene, &s->defaults, &integrator, s->cli.scene);
}

static int debug_path(struct pt_session *s, struct base_err *err)
{
    struct pt_integrator integrator = s->defaults.integrator;
    const int *at = s->cli.debug;
    pt_setup_override(&s->cli, &integrator);
    if (at[0] >= s->defaults.width || at[1] >= s->defaults.height)
        return base_fail(err, BASE_EINVAL, "--debug-path %d,%d,%d: the image has %dx%d pixels", at[0], at[1], at[2],
                         s->defaults.width, s->defaults.height);
    pt_kernel_trace(s->scene, &integrator, (uint32_t)at[0], (uint32_t)at[1], (uint32_t)at[2], stdout);
    return 0;
}

static int run(struct pt_session *s, int *status, struct base_err *err)
{
    if (s->cli.action == PT_CLI_LIST_CRITERIA) {
        if (pt_criterion_list(stdout, &s->log) == 0)
            return base_fail(err, BASE_EINVAL, "no criterion was found (LULL_PLUGIN_PATH names more folders to look in)");
        return 0;
    }
    int rc = pt_session_open(s, err);
    if (rc)
        return rc;
    base_interrupt_catch();
    switch (s->cli.action) {
    case PT_CLI_EXPLAIN: explain(s); return 0;
    case PT_CLI_DEBUG_PATH: return debug_path(s, err);
    case PT_CLI_QUOTE: return pt_action_quote(s, status, err);
    case PT_CLI_SEQUENCE: return pt_action_sequence(s, status, err);
    default: return pt_action_image(s, status, err);
    }
}

int main(int argc, char **argv)
{
    static struct pt_session s = {.scene_files = BASE_INPUTS_EMPTY, .judging = BASE_INPUTS_EMPTY};
    struct base_err err = {0}, job_err = {0};
    int status = 0;
    s.start_s = base_clock_wall_s();
    int rc = pt_cli_parse(&s.cli, argc, argv, &err);
    if (job_open(&s.job, rc ? &job_err : &err) != 0 && !rc)
        rc = err.code;
    if (job_rank(s.job) == 0)
        base_log_init(&s.log, stderr, "lull-render", s.cli.quiet);
    job_watch(s.job, s.cli.rank_timeout_s, &base_interrupted);
    if (!rc && job_rank(s.job) > 0) {
        rc = pt_worker_run(&s, &err);
    } else if (!rc) {
        pt_progress_init(&s.progress, &s.log);
        rc = run(&s, &status, &err);
    }
    if (rc) {
        base_log_say(&s.log, "%s", err.text);
        status = rc == BASE_EINVAL || rc == BASE_EIO ? PT_EXIT_BAD_INPUT : PT_EXIT_FAILED;
    }
    pt_session_release(&s);
    if ((fflush(stdout) != 0 || ferror(stdout)) && status == 0) {
        base_log_say(&s.log, "cannot write standard output");
        status = PT_EXIT_BAD_INPUT;
    }
    int all = job_close(s.job, status, err.text, &job_err);
    if (all != status && job_err.code)
        base_log_say(&s.log, "%s", job_err.text);
    return all;
}
