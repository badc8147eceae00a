#include "watch.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/files.h"
#include "base/interrupt.h"
#include "base/options.h"
#include "render/checkpoint.h"

/* By the first of these that is set, as the C library does. */
static int speaks_utf8(void)
{
    static const char *const names[] = {"LC_ALL", "LC_CTYPE", "LANG"};
    const char *locale = NULL;
    for (size_t i = 0; i < sizeof names / sizeof names[0] && (!locale || !*locale); i++)
        locale = getenv(names[i]);
    return locale &&
           (strstr(locale, "UTF-8") || strstr(locale, "utf8") || strstr(locale, "UTF8") || strstr(locale, "utf-8"));
}

static void format_quality(const struct pt_open *o, char *text, size_t room)
{
    const struct lull_criterion *t = lull_host_table(o->criterion);
    double value;
    const struct lull_param *p = t ? lull_host_quality(t, o->params.list, o->params.count, &value) : NULL;
    if (p)
        snprintf(text, room, "criterion %s, %s %g", t->id, p->name, value);
}

static const char *path_of(const struct pt_watch *w, enum pt_path which) { return w->open->frame->paths[which]; }

/* A checkpoint that fails on the way costs nothing yet: the next one may succeed. */
static void save_now_and_then(struct pt_watch *w, const struct pt_render *render)
{
    struct base_err why = {0};
    if (pt_checkpoint_save(path_of(w, PT_CHECKPOINT), render, &w->open->identity, &why) != 0)
        base_log_say(w->open->log, "no checkpoint, the render goes on: %s", why.text);
    w->checkpoint_at_s = base_clock_wall_s() + w->open->cli->checkpoint_every_s;
}

static int is_interrupted(void *data)
{
    (void)data;
    return base_interrupted != 0;
}

/* Denoised, which takes some 10 us a pixel and processor, when that is less than a hundredth of the time so far. */
static void write_preview(const struct pt_watch *w, const struct pt_render *render, struct base_err *err)
{
    const double share = 0.01, denoised_s = 10e-6;
    const struct pt_open *o = w->open;
    struct pt_denoised denoised = {0};
    const double so_far_s = base_clock_wall_s() - o->start_s, to_denoise_s = denoised_s * (double)render->film.pixels;
    if (o->picture != PT_PICTURE_NOISY && to_denoise_s / base_threads_count(o->threads) < share * so_far_s)
        pt_denoised_make(render, PT_PICTURE_DENOISED, o->denoiser, is_interrupted, &denoised, err);
    const struct pt_output_info info = {.denoised = denoised.rgb ? &denoised : NULL};
    pt_output_preview(path_of(w, PT_PREVIEW), render, &info, err);
    pt_denoised_release(&denoised);
}

/* The report last: who watches it finds the others as new as it is, or newer. */
static void write_live(struct pt_watch *w, const struct pt_render *render, struct base_err *err)
{
    const struct pt_progress_now progress = pt_progress_of(&w->progress.pace, render);
    struct pt_output_info info = *w->info;
    info.progress = &progress;
    for (enum pt_path i = PT_STOP_MAPS; i < PT_PATHS && path_of(w, i); i++)
        pt_output_stop_map(path_of(w, i), render, &info, err);
    if (path_of(w, PT_REPORT))
        pt_output_report(path_of(w, PT_REPORT), render, &info, err);
}

/* The picture so far: after the first slice, then when three times as long has passed, at most so often that it takes a
 * hundredth of the time. Live files: each second, if that takes less than a twentieth. A file that cannot be written costs
 * nothing yet: the last one is what fails. */
static void write_files(struct pt_watch *w, const struct pt_render *render)
{
    const double ratio = 3.0, longest_s = 60.0, share = 0.01, live_s = 1.0, live_share = 0.05;
    const int live = w->open->cli->live;
    struct base_err ignored = {0};
    double begin_s = base_clock_wall_s();
    if (path_of(w, PT_PREVIEW))
        write_preview(w, render, &ignored);
    if (live)
        write_live(w, render, &ignored);
    double now_s = base_clock_wall_s(), took_s = now_s - begin_s;
    double later_s = fmax(fmin(ratio * (now_s - w->open->start_s), longest_s), took_s / share);
    w->files_at_s = live ? fmax(begin_s + live_s, now_s + took_s / live_share) : now_s + later_s;
}

static int after_slice(void *data, struct pt_render *render, struct base_err *err)
{
    struct pt_watch *w = data;
    (void)err;
    if (w->info && (path_of(w, PT_PREVIEW) || w->open->cli->live) && !base_interrupted &&
        base_clock_wall_s() >= w->files_at_s)
        write_files(w, render);
    if (w->display)
        lull_host_display_update(w->display, &render->shown.view, NULL);
    pt_progress_update(&w->progress, render);
    if (path_of(w, PT_CHECKPOINT) && !base_interrupted && base_clock_wall_s() >= w->checkpoint_at_s)
        save_now_and_then(w, render);
    return 0;
}

static int suspend(void *data, struct pt_render *render, struct base_err *err)
{
    const struct pt_watch *w = data;
    return path_of(w, PT_CHECKPOINT) ? pt_checkpoint_save(path_of(w, PT_CHECKPOINT), render, &w->open->identity, err) : 0;
}

int pt_watch_init(struct pt_watch *w, const struct pt_open *open, const struct pt_output_info *info, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    *w = (struct pt_watch){
        .open = open,
        .info = info,
        .hooks = {.slice = after_slice, .interrupted = &base_interrupted, .suspend = suspend, .log = open->log, .data = w},
        .checkpoint_at_s = base_clock_wall_s() + open->cli->checkpoint_every_s};
    pt_progress_init(&w->progress, w->open->log);
    w->progress.map = w->open->log->terminal && speaks_utf8();
    format_quality(open, w->progress.quality, sizeof w->progress.quality);
    if (!open->cli->display)
        return 0;
    int32_t code = lull_host_display_open(open->render->frame, open->cli->display,
                                          base_file_name(open->frame->paths[PT_SCENE]), &w->display, &e);
    return code == LULL_OK ? 0 : base_fail(err, pt_host_result(code, &e, NULL), "--display-server %s", e.message);
}

void pt_watch_end(struct pt_watch *w)
{
    base_log_clear(w->open->log);
    if (w->display && !lull_host_display_close(w->display, &w->open->render->shown.view))
        base_log_note(w->open->log, "--display-server: no viewer has taken the last picture");
    w->display = NULL;
}
