/*
 * One run of the program: what the command line says and what is made of it. Filled from top to bottom (session.c, setup.c),
 * then read and driven by the actions (actions.h) on rank 0 and by member.h elsewhere. One of them, in static memory.
 */
#ifndef PT_SESSION_H
#define PT_SESSION_H

#include "base/inputs.h"
#include "cli.h"
#include "integ/integrator.h"
#include "job/job.h"
#include "render/progress.h"
#include "render/quote.h"
#include "render/render.h"
#include "scene/scene.h"

struct pt_session {
    struct pt_cli cli;
    struct base_inputs scene_files, judging; /* what was read; judging: plugin and mask */
    struct base_log log;                     /* of rank 0; silent elsewhere */
    struct job *job;                         /* NULL: this process is alone */
    struct base_threads *threads;
    struct pt_scene *scene;
    struct pt_scene_defaults defaults;
    struct pt_mask mask;
    struct lull_host_criterion *criterion;
    struct pt_render *render;
    struct pt_quote *quote;
    double start_s; /* wall time of the program's start */
    struct pt_progress progress;
    pt_kernel *kernel;
    const char *kernel_name;
    char settings[4096];    /* what decides the image, for checkpoints */
    double checkpoint_at_s; /* wall time of the next one */
    double preview_at_s;    /* likewise, while rendering */
    char default_output[1024];
};

/* Makes threads and scene. BASE_EINVAL when the scene or a file of it is not as it should be. */
int pt_session_open(struct pt_session *session, struct base_err *err);
/* All but the job. */
void pt_session_release(struct pt_session *session);

/* base_interrupted as a hook; data: not used. */
int pt_interrupted(void *data);

#endif
