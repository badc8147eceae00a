#include "actions.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/interrupt.h"
#include "render/checkpoint.h"
#include "render/output.h"
#include "watch.h"

/* What the criterion of noisy pictures says of this one, [blocks], the caller's; NULL when nobody can say. */
static double *judge_noisy(const struct pt_open *o)
{
    const struct pt_render_work *scratch = &o->render->work; /* the render is over */
    const uint32_t n = o->render->blocks->count;
    struct lull_host_criterion *observer = NULL;
    const struct lull_criterion *table;
    struct base_err ignored = {0};
    double *errors = calloc(n, sizeof *errors);
    int rc = !errors || !(o->render->film.planes & PT_FILM_HALF) ||
             pt_criterion_find(PT_OPEN_NOISY_CRITERION, NULL, NULL, &table, &ignored) ||
             pt_criterion_create(table, NULL, 0, o->threads, NULL, &observer, &ignored) ||
             lull_host_join(o->render->frame, observer, NULL) != LULL_OK;
    for (uint32_t i = 0; i < n; i++)
        scratch->due[i] = i;
    rc = rc || lull_host_evaluate(observer, o->render->frame, &o->render->shown.view, scratch->due, NULL, n,
                                  scratch->decisions, NULL) != LULL_OK;
    for (uint32_t i = 0; !rc && i < n; i++)
        errors[i] = scratch->decisions[i].error;
    lull_host_close(observer);
    if (!rc)
        return errors;
    free(errors);
    return NULL;
}

static void write_all(const struct pt_open *o, const struct pt_output_info *info, struct base_err *err)
{
    const char *const *paths = o->frame->paths;
    pt_output_or_keep(pt_output_exr, paths[PT_OUTPUT], o->render, info, err);
    pt_output_or_keep(pt_output_preview, paths[PT_PREVIEW], o->render, info, err);
    for (int i = PT_STOP_MAPS; i < PT_PATHS; i++)
        pt_output_or_keep(pt_output_stop_map, paths[i], o->render, info, err);
    pt_output_or_keep(pt_output_report, paths[PT_REPORT], o->render, info, err);
    pt_output_or_keep(pt_output_page, paths[PT_PAGE], o->render, info, err);
}

/* The processor's name; NULL where the system does not say. */
static const char *processor_name(char text[128])
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    text[0] = '\0';
    while (file && text[0] == '\0' && fgets(line, sizeof line, file))
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':'))
            snprintf(text, 128, "%.*s", (int)strcspn(strchr(line, ':') + 2, "\n"), strchr(line, ':') + 2);
    if (file)
        fclose(file);
    return text[0] ? text : NULL;
}

/* What the files say of a render, whose picture is the noisy one. */
static struct pt_output_info describe(const struct pt_open *o, const char *quote, const char *processor)
{
    const struct pt_cli *cli = o->cli;
    return (struct pt_output_info){.of = {.scene = o->frame->paths[PT_SCENE],
                                          .mask = cli->mask,
                                          .kernel = o->kernel_name,
                                          .scene_bytes = (double)o->scene->stats.bytes,
                                          .processor = processor,
                                          .command = (const char *const *)cli->argv,
                                          .command_count = (uint64_t)cli->argc},
                                   .params = o->params.list,
                                   .param_count = o->params.count,
                                   .effects = o->scene->effects,
                                   .reproducible = cli->reproducible,
                                   .quote = quote};
}

static int is_asked_again(void *before) { return base_interrupted != *(const sig_atomic_t *)before; }

/* Writes what was asked for; goes on after a failure so that one missing folder, or a denoiser that fails, does not cost the
 * other files. Who is asked to end while the picture is denoised writes the noisy one. */
static int write_outputs(const struct pt_open *o, struct pt_output_info info, int *status, struct base_err *err)
{
    struct pt_denoised denoised = {0};
    struct base_err why = {0};
    sig_atomic_t before = base_interrupted;
    double *noisy_error = NULL;
    if (o->picture != PT_PICTURE_NOISY) {
        pt_denoised_make(o->render, o->picture, o->denoiser, is_asked_again, &before, &denoised, &why);
        if (is_asked_again(&before)) {
            *status = PT_EXIT_INTERRUPTED;
            info.of.flags |= LULL_REPORT_INTERRUPTED;
            if (o->frame->number >= 0)
                return 0;
        }
        info.denoised = why.code ? NULL : &denoised;
        info.noisy_error = noisy_error = o->criterion ? judge_noisy(o) : NULL;
    }
    write_all(o, &info, err);
    if (info.denoised && o->picture == PT_PICTURE_BLEND)
        base_log_note(o->log, "denoised; %.0f %% of the picture is the noisy one, where the denoiser is not trusted",
                      100.0 * denoised.weight_mean);
    pt_denoised_release(&denoised);
    free(noisy_error);
    if (why.code && is_asked_again(&before))
        base_log_say(o->log, "the picture is the noisy one: interrupted while it was denoised");
    else if (why.code && !err->code)
        base_fail(err, why.code, "the picture is the noisy one: %s", why.text);
    return err->code;
}

void pt_action_summary(const struct pt_render *r, struct base_log *log)
{
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
    base_log_note(log, "%s", line);
    uint32_t kept = 0;
    const struct lull_host_sample *dropped = lull_host_dropped(r->frame, &kept);
    if (r->totals->dropped > 0 && kept > 0)
        base_log_say(log, "%llu samples were not finite and were dropped, the first seen at --debug-path %u,%u,%u",
                     (unsigned long long)r->totals->dropped, dropped[0].x, dropped[0].y, dropped[0].sample);
}

/* Samples of the shot's table, which has to be one of such pictures. */
static int plan_blocks(const struct pt_open *o, struct base_err *err)
{
    const struct pt_shot_table *table = o->frame->table;
    struct pt_render *r = o->render;
    char grid[PT_SHOT_GRID];
    pt_shot_table_grid(&r->config, grid);
    if (strcmp(grid, table->grid) != 0 || table->block_count != r->blocks->count)
        return base_fail(err, BASE_EINVAL, "%s: made for %s with %zu blocks, this frame has %s with %u", o->cli->shot.table,
                         table->grid, table->block_count, grid, r->blocks->count);
    pt_render_plan(r, o->frame->block_spp);
    return 0;
}

int pt_action_status(enum pt_render_outcome outcome)
{
    return outcome == PT_RENDER_INTERRUPTED ? PT_EXIT_INTERRUPTED : outcome == PT_RENDER_LOST ? PT_EXIT_BAD_INPUT : 0;
}

/* An interrupted image is written as it is, but no frame of a shot: a file of its name would say that the frame is done. */
static int render_image(struct pt_open *o, const char *quote, int *status, struct base_err *err)
{
    const struct pt_shot_frame *frame = o->frame;
    enum pt_render_outcome outcome;
    struct pt_watch watch;
    char processor[128];
    struct pt_output_info info = describe(o, quote, processor_name(processor));
    int rc = frame->resume ? pt_checkpoint_load(frame->paths[PT_CHECKPOINT], o->render, &o->identity, err) : 0;
    if (!rc && frame->table)
        rc = plan_blocks(o, err);
    if (!rc)
        rc = pt_watch_init(&watch, o, &info, err);
    if (rc)
        return rc;
    rc = pt_render_run(o->render, &watch.hooks, &outcome, err);
    pt_watch_end(&watch);
    struct base_err write_err = {0};
    *status = pt_action_status(outcome);
    if (frame->number >= 0 && (rc || *status != 0))
        return rc;
    info.of.flags = *status != 0 ? LULL_REPORT_INTERRUPTED : 0;
    if (write_outputs(o, info, status, &write_err) != 0) {
        if (!rc)
            return base_fail(err, write_err.code, "%s", write_err.text);
        base_log_say(o->log, "%s", write_err.text); /* besides the render's own error: it tells where the image is */
        return rc;
    }
    pt_action_summary(o->render, o->log);
    return rc;
}

/* What was quoted, the caller's: looked at before the work, because the page is written after it. */
static int read_quote(const char *path, char **text, struct base_err *err)
{
    const size_t most = 1 << 28;
    size_t size;
    int rc = base_file_read(path, most, text, &size, err);
    if (rc)
        return rc;
    cJSON *quote = cJSON_Parse(*text);
    if (!cJSON_IsArray(cJSON_GetObjectItemCaseSensitive(quote, "rows"))) {
        free(*text);
        *text = NULL;
        rc = base_fail(err, BASE_EINVAL, "--quoted %s: no quote (expected what --quote --json prints)", path);
    }
    cJSON_Delete(quote);
    return rc;
}

int pt_action_image(struct pt_open *o, int *status, struct base_err *err)
{
    char *quote = NULL;
    const char *quoted = o->frame->paths[PT_QUOTED];
    int rc = quoted ? read_quote(quoted, &quote, err) : 0;
    if (!rc)
        rc = render_image(o, quote, status, err);
    free(quote);
    return rc;
}
