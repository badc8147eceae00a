#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "actions.h"
#include "base/interrupt.h"
#include "base/threads.h"

static int list_criteria(struct base_log *log, struct base_err *err)
{
    if (pt_criterion_list(stdout, log) == 0)
        return base_fail(err, BASE_EINVAL, "no criterion was found (LULL_PLUGIN_PATH names more folders to look in)");
    return 0;
}

/* Workers open what rank 0 opens, where they can help. Who interrupts or ends the job does it through rank 0. */
static int run(const struct pt_cli *cli, struct job *job, struct base_log *log, int *status, struct base_err *err)
{
    struct pt_open open = {0};
    struct pt_shot_frame frame;
    if (job_rank(job) > 0) {
        base_interrupt_ignore();
        if (!pt_cli_samples(cli))
            return 0;
    }
    if (cli->action == PT_CLI_LIST_CRITERIA)
        return list_criteria(log, err);
    int rc = pt_frame_alone(&frame, cli, err);
    if (!rc)
        rc = pt_open_init(&open, cli, job, log, err);
    if (!rc)
        rc = pt_action_frame(&open, &frame, job, status, err);
    pt_open_release(&open);
    pt_frame_release(&frame);
    return rc;
}

/* no-color.org: set and not empty; a terminal without a cursor that moves. */
static int wants_plain_lines(void)
{
    const char *no_color = getenv("NO_COLOR"), *term = getenv("TERM");
    return (no_color && *no_color) || (term && strcmp(term, "dumb") == 0);
}

static int run_program(int argc, char **argv)
{
    static struct pt_cli cli;
    struct job *job = NULL;
    struct base_err err = {0}, job_err = {0};
    int status = 0;
    base_interrupt_begin();
    int rc = pt_cli_parse(&cli, argc, argv, &err);
    if (job_open(&job, rc ? &job_err : &err) != 0 && !rc)
        rc = err.code;
    struct base_log log;
    base_log_init(&log, job_rank(job) == 0 ? stderr : NULL, "lull-render", cli.quiet);
    if (cli.no_progress || wants_plain_lines())
        log.terminal = 0;
    job_watch(job, pt_cli_is_shot(&cli) ? 0.0 : cli.rank_timeout_s, &base_interrupted); /* whole frames take long */
    if (!rc)
        rc = pt_cli_is_shot(&cli) ? pt_shot_run(&cli, job, &log, &status, &err) : run(&cli, job, &log, &status, &err);
    if (rc) {
        base_log_say(&log, "%s", err.text);
        status = rc == BASE_EINVAL || rc == BASE_EIO ? PT_EXIT_BAD_INPUT : PT_EXIT_FAILED;
    }
    pt_cli_release(&cli);
    status = base_interrupt_end(status == 0 && job_rank(job) == 0 ? "lull-render" : NULL, status);
    int all = job_close(job, status, err.text, &job_err);
    if (all != status && job_err.code)
        base_log_say(&log, "%s", job_err.text);
    return all;
}

int main(int argc, char **argv) { return base_threads_main(argc, argv, run_program); }
