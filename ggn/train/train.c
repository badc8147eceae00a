#include "train/train.h"

#include <stdio.h>
#include <sys/stat.h>

#include "data/agree.h"
#include "train/finish.h"
#include "train/phase_denoiser.h"
#include "train/phase_classifier.h"
#include "train/resume.h"

static void announce(const struct ggn_session *s)
{
    if (!s->plan->progress)
        return;
    fprintf(s->plan->progress,
            "%d scenes; blocks: %d training (+ %d synthetic), %d validation; windows: %d training, %d validation; levels "
            "from %g, %s %g%s\n",
            s->set.n_scenes, ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 0) - ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_series_set_count(&s->set, GGN_SPLIT_VALIDATION, 1), s->train.n, s->validation.n, s->set.first_spp,
            s->set.ratio > 0 ? "ratio" : "step", s->set.ratio > 0 ? s->set.ratio : s->set.step_spp,
            s->set.n_levels ? " behind those of the recording" : "");
    if (!s->validation.n)
        fprintf(s->plan->progress, "no validation windows: the last epoch counts and p stays uncalibrated\n");
}

/* gnuplot is optional: without it there is no picture. */
static void draw_curves(const struct ggn_session *s)
{
    char path[4096];
    struct base_err err = {0};

    ggn_session_path(s, ".png", path, sizeof path);
    if (ggn_log_draw(&s->log, path, &err) && s->plan->progress)
        fprintf(s->plan->progress, "no picture of the learning curves: %s\n", err.text);
}

/* --- several processes ------------------------------------------------------------------------------------------------ */

/* Only rank 0 needs to see the checkpoint. *path is set to NULL where there is none. */
static int find_checkpoint(const struct ggn_train_plan *plan, const char **path, int *phase, struct base_err *err)
{
    struct stat st;
    int rc = 0, found[2] = {*phase, 0};

    if (job_rank(plan->job) == 0 && plan->resume && stat(*path, &st) == 0) {
        rc = ggn_resume_phase(*path, &found[0], err);
        found[1] = 1;
    }
    if (!rc)
        rc = job_broadcast(plan->job, found, sizeof found);
    *phase = found[0];
    *path = found[1] ? *path : NULL;
    return rc;
}

static void tell_traffic(const struct ggn_session *s)
{
    const struct job_traffic t = job_traffic(s->plan->job);
    double steps = s->plan->steps_r + (double)s->progress.step;

    if (s->plan->job && s->plan->progress)
        fprintf(s->plan->progress, "%d processes: %.0f messages, %.2f MB per step at rank 0, which waited %.1f s for them\n",
                job_count(s->plan->job), (double)t.messages / steps, (double)t.bytes / steps * 1e-6, t.waiting_s);
}

int ggn_train(const struct ggn_train_plan *plan, struct base_err *err)
{
    struct ggn_session s = {.plan = plan};
    char path[4096];
    const char *checkpoint = path;
    int phase = plan->preset == GGN_PRESET_PAPER ? GGN_PHASE_CLASSIFIER : GGN_PHASE_DENOISER;

    ggn_session_path(&s, ".ckpt", path, sizeof path);
    int rc = find_checkpoint(plan, &checkpoint, &phase, err);
    if (!rc)
        rc = ggn_session_init(&s, err);
    if (!rc)
        announce(&s);
    if (!rc && plan->init)
        rc = ggn_session_load_init(&s, err);
    if (!rc)
        rc = ggn_agree(plan->job, &s.set, &plan->init, plan->init != NULL, ggn_resume_key(&s), base_threads_count(s.threads),
                       err);
    if (!rc && phase == GGN_PHASE_DENOISER) {
        rc = ggn_phase_denoiser(&s, checkpoint, err);
        checkpoint = NULL;
    }
    if (!rc)
        rc = ggn_phase_classifier(&s, checkpoint, err);
    if (!rc)
        rc = ggn_session_finish(&s, err);
    if (!rc && job_rank(plan->job) == 0) {
        draw_curves(&s);
        tell_traffic(&s);
    }
    ggn_session_release(&s);
    return rc;
}
