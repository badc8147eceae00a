#include "actions.h"

#include <stdio.h>
#include <zlib.h>

#include "base/interrupt.h"
#include "base/version.h"
#include "render/farm.h"
#include "watch.h"

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

static int crc_of(const char *path, uint32_t *crc, struct base_err *err)
{
    struct base_inputs one = BASE_INPUTS_EMPTY;
    int rc = base_inputs_add(&one, path, err);
    if (!rc)
        rc = base_inputs_crc32(&one, crc, err);
    base_inputs_release(&one);
    return rc;
}

static int record(struct pt_open *o, int *status, struct base_err *err)
{
    struct pt_sequence_config config = o->cli->sequence;
    struct pt_watch watch;
    int was_interrupted = 0;
    config.scene_path = o->frame->paths[PT_SCENE];
    config.view = o->view;
    config.render = o->config;
    config.criterion = !o->criterion ? NULL : o->cli->criterion ? o->cli->criterion : PT_OPEN_NOISY_CRITERION;
    config.pairs = o->params.list;
    config.pair_count = o->params.count;
    int rc = crc_of(o->frame->paths[PT_SCENE], &config.scene_crc, err);
    if (!rc)
        rc = base_inputs_crc32(&o->scene_files, &config.inputs_crc, err);
    if (!rc)
        rc = pt_watch_init(&watch, o, NULL, err);
    if (rc)
        return rc;
    rc = (config.planes ? pt_sequence_record_frame : pt_sequence_record)(&config, o->scene, o->kernel, o->threads,
                                                                         o->criterion, &watch.hooks, &was_interrupted, err);
    pt_watch_end(&watch);
    *status = was_interrupted ? PT_EXIT_INTERRUPTED : 0;
    return rc;
}

static int act(struct pt_open *o, int *status, struct base_err *err)
{
    const struct pt_cli *cli = o->cli;
    switch (cli->action) {
    case PT_CLI_EXPLAIN: return explain(o, err);
    case PT_CLI_DEBUG_PATH: return pt_action_debug_path(o->scene, &o->config, cli->debug, err);
    case PT_CLI_QUOTE: return pt_action_quote(o, status, err);
    case PT_CLI_SEQUENCE: return record(o, status, err);
    default: return pt_action_image(o, status, err);
    }
}

static int32_t add_to_crc(const struct lull_writer *to, const void *data, uint64_t size)
{
    uint32_t *crc = to->context;
    *crc = (uint32_t)crc32_z(*crc, data, (size_t)size);
    return LULL_OK;
}

int pt_agree_identity(const struct pt_open *o, struct base_identity *to, struct base_err *err)
{
    uint32_t crc = (uint32_t)crc32(0, NULL, 0);
    struct lull_writer adder = {.struct_size = sizeof adder, .context = &crc, .write = add_to_crc};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = o->render && o->criterion ? lull_host_save_history(o->criterion, &adder, &e) : LULL_OK;
    if (code != LULL_OK)
        return pt_host_result(code, &e, err);
    base_identity_add(to, "version", "%s", BASE_VERSION);
    base_identity_append(to, &o->identity);
    base_identity_add(to, "criterion-model-crc", "%08x", (unsigned)crc);
    return base_identity_check(to, err);
}

/* Every process of a job, ready to begin: rank 0 waits for all and refuses those that differ. */
static int shake_hands(const struct pt_open *o, struct job *job, struct base_err *err)
{
    struct base_identity all = {0};
    uint32_t program_crc = 0; /* two builds may have one version; 0 where the system does not show the file */
    int rc = pt_agree_identity(o, &all, err);
    if (crc_of("/proc/self/exe", &program_crc, NULL) != 0)
        program_crc = 0;
    base_identity_add(&all, "program-crc", "%08x", (unsigned)program_crc);
    if (!rc)
        rc = base_identity_check(&all, err);
    if (!rc)
        rc = job_handshake(job, all.text, base_threads_count(o->threads), err);
    base_identity_release(&all);
    return rc;
}

int pt_action_frame(struct pt_open *o, const struct pt_shot_frame *frame, struct job *job, int *status, struct base_err *err)
{
    const int works = job_rank(job) > 0, samples = pt_cli_samples(o->cli);
    int rc = pt_open_scene(o, frame, err);
    if (!rc && samples)
        rc = pt_open_frame(o, job, err);
    if (!rc && !works) /* before that there is nothing to save, and a criterion may never return from being loaded */
        base_interrupt_catch();
    if (!rc && samples && job)
        rc = shake_hands(o, job, err);
    if (!rc)
        rc = works ? pt_farm_serve(job, o->threads, &(struct pt_sampler_context){o->scene, o->kernel, NULL}, err)
                   : act(o, status, err);
    pt_open_end_frame(o);
    return rc;
}
