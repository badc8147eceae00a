#include "actions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "agree.h"
#include "base/clock.h"
#include "render/checkpoint.h"
#include "render/output.h"
#include "setup.h"

/* A checkpoint that fails on the way costs nothing yet: the next one may succeed. */
static void save_now_and_then(struct pt_session *s, const struct pt_render *render)
{
    struct base_err why = {0};
    if (pt_checkpoint_save(s->cli.checkpoint, render, s->settings, &why) != 0)
        base_log_say(&s->log, "no checkpoint, the render goes on: %s", why.text);
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
}

int pt_action_after_slice(void *data, struct pt_render *render, struct base_err *err)
{
    struct pt_session *s = data;
    (void)err;
    pt_progress_update(&s->progress, render);
    if (s->cli.checkpoint && !pt_interrupted(NULL) && base_clock_wall_s() >= s->checkpoint_at_s)
        save_now_and_then(s, render);
    return 0;
}

/* The picture so far: after the first slice, then when three times as long has passed, at most so often that it takes a
 * hundredth of the time. One that cannot be written costs nothing yet: the last one is what fails. */
static void show_preview(struct pt_session *s, const struct pt_render *render)
{
    const double ratio = 3.0, longest_s = 60.0, share = 0.01;
    struct base_err ignored = {0};
    double begin_s = base_clock_wall_s();
    pt_output_preview(s->cli.preview, render, &ignored);
    double now_s = base_clock_wall_s();
    s->preview_at_s = now_s + fmax(fmin(ratio * (now_s - s->start_s), longest_s), (now_s - begin_s) / share);
}

static int after_slice_of_image(void *data, struct pt_render *render, struct base_err *err)
{
    struct pt_session *s = data;
    if (s->cli.preview && !pt_interrupted(NULL) && base_clock_wall_s() >= s->preview_at_s)
        show_preview(s, render);
    return pt_action_after_slice(data, render, err);
}

int pt_action_suspend(void *data, struct pt_render *render, struct base_err *err)
{
    struct pt_session *s = data;
    return s->cli.checkpoint ? pt_checkpoint_save(s->cli.checkpoint, render, s->settings, err) : 0;
}

typedef int writer(const char *path, const struct pt_render *render, const struct pt_output_info *info,
                   struct base_err *err);

static int write_preview(const char *path, const struct pt_render *render, const struct pt_output_info *info,
                         struct base_err *err)
{
    (void)info;
    return pt_output_preview(path, render, err);
}

/* What cannot be written after all is kept where temporary files go. On failure err says so; on success it stays. */
static void write_or_keep(const struct pt_session *s, writer *write, const char *path, const struct pt_output_info *info,
                          struct base_err *err)
{
    struct base_err why = {0}, again = {0};
    char kept[4096];
    if (!path || write(path, s->render, info, &why) == 0)
        return;
    *err = why;
    const char *folder = getenv("TMPDIR");
    int n = snprintf(kept, sizeof kept, "%s/lull-%ld-%s", folder && folder[0] != '\0' ? folder : "/tmp", (long)getpid(),
                     base_file_name(path));
    if (n < (int)sizeof kept && write(kept, s->render, info, &again) == 0)
        base_fail(err, why.code, "%.320s; kept as %.160s", why.text, kept);
}

/* Writes what was asked for; goes on after a failure so that one missing folder does not cost the other files. */
static int write_outputs(struct pt_session *s, int was_interrupted, struct base_err *err)
{
    const struct pt_cli *cli = &s->cli;
    struct pt_output_info info = {.scene = cli->scene,
                                  .params = cli->params,
                                  .param_count = cli->param_count,
                                  .mask = cli->mask,
                                  .effects = s->scene->effects,
                                  .kernel = s->kernel_name,
                                  .threads = pt_render_threads(s->render),
                                  .reproducible = cli->reproducible,
                                  .aov = cli->aov,
                                  .scene_bytes = s->scene->stats.bytes,
                                  .interrupted = was_interrupted};
    write_or_keep(s, pt_output_exr, cli->output, &info, err);
    write_or_keep(s, write_preview, cli->preview, &info, err);
    for (int i = 0; i < cli->stop_map_count; i++)
        write_or_keep(s, pt_output_stop_map, cli->stop_maps[i], &info, err);
    write_or_keep(s, pt_output_report, cli->report, &info, err);
    return err->code;
}

static void tell_summary(struct pt_session *s)
{
    const struct pt_render *r = s->render;
    uint32_t by_reason[LULL_REASON_COUNT] = {0};
    for (uint32_t i = 0; i < r->blocks->count; i++)
        by_reason[r->blocks->list[i].reason]++;
    double pixels = (double)r->film.pixels;
    char line[512];
    size_t used = (size_t)snprintf(
        line, sizeof line,
        "%.0f spp on average, %.1f s, %.2f Mpaths/s, criterion %.1f %%; blocks:", (double)r->totals->samples / pixels,
        lull_host_elapsed_s(r->frame), (double)r->totals->paths / fmax(r->totals->render_s, 1e-9) * 1e-6,
        100.0 * r->totals->criterion_s / fmax(lull_host_elapsed_s(r->frame), 1e-9));
    for (int i = 0; i < LULL_REASON_COUNT && used < sizeof line; i++)
        if (by_reason[i] > 0)
            used += (size_t)snprintf(line + used, sizeof line - used, " %u %s", by_reason[i], lull_host_reason(i));
    base_log_note(&s->log, "%s", line);
    uint32_t kept = 0;
    const struct lull_host_sample *dropped = lull_host_dropped(r->frame, &kept);
    if (r->totals->dropped > 0 && kept > 0)
        base_log_say(&s->log, "%llu samples were not finite and were dropped, the first seen at --debug-path %u,%u,%u",
                     (unsigned long long)r->totals->dropped, dropped[0].x, dropped[0].y, dropped[0].sample);
}

/* …and as far as a checkpoint to be resumed had come. */
int pt_action_open_render(struct pt_session *s, struct base_err *err)
{
    int rc = pt_setup_render(s, err);
    if (!rc)
        rc = pt_agree_handshake(s, err);
    if (!rc && s->cli.resume)
        rc = pt_checkpoint_load(s->cli.checkpoint, s->render, s->settings, err);
    if (rc == BASE_EIO)
        rc = err->code = BASE_EINVAL; /* the checkpoint is an input */
    return rc;
}

int pt_action_status(enum pt_render_outcome outcome)
{
    return outcome == PT_RENDER_INTERRUPTED ? PT_EXIT_INTERRUPTED : outcome == PT_RENDER_LOST ? PT_EXIT_BAD_INPUT : 0;
}

int pt_action_image(struct pt_session *s, int *status, struct base_err *err)
{
    enum pt_render_outcome outcome;
    int rc = pt_action_open_render(s, err);
    if (rc)
        return rc;
    struct pt_render_hooks hooks = {.slice = after_slice_of_image,
                                    .interrupted = pt_interrupted,
                                    .suspend = pt_action_suspend,
                                    .log = &s->log,
                                    .data = s};
    s->checkpoint_at_s = base_clock_wall_s() + s->cli.checkpoint_every_s;
    rc = pt_render_run(s->render, &hooks, &outcome, err);
    base_log_clear(&s->log);
    struct base_err write_err = {0};
    if (write_outputs(s, pt_action_status(outcome) != 0, &write_err) != 0) {
        if (rc)
            base_log_say(&s->log, "%s", write_err.text); /* besides the render's own error: it tells where the image is */
        else
            rc = base_fail(err, write_err.code, "%s", write_err.text);
        return rc;
    }
    tell_summary(s);
    *status = pt_action_status(outcome);
    return rc;
}
