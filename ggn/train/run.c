/* A training from beginning to end. */
#include "train/train.h"

#include <stdio.h>

#include "train/phase.h"

struct ggn_train_plan ggn_train_plan_default(enum ggn_preset preset)
{
    const int lull = preset == GGN_PRESET_LULL;
    return (struct ggn_train_plan){
        .data = {.ratio = lull ? 1.1 : 0},
        .hyper = {.preset = preset, .window = 6, .k_r = lull ? 8 : 16, .k_m = lull ? 10 : 20, .k_d = lull ? 32 : 64},
        .batch_r = 16,
        .batch = lull ? 16 : 64,
        .steps_r = lull ? 2000 : 0,
        .steps = lull ? 2000 : 0,
        .epochs = 30,
        .epoch_steps = lull ? 100 : 0,
        .patience = lull ? 8 : 0,
        .lr_r = lull ? 1e-3 : 2e-4,
        .lr = lull ? 1e-3 : 2e-4,
        .difference = lull ? 8 : 0,
        .soft_labels = lull,
        .flips = lull,
        .jitter = lull ? 0.3 : 0,
        .scalars = lull,
        .synthetic = lull ? 1 : 0,
        .extend = lull,
        .validation_windows = 400,
        .early_rate = 0.02,
        .seed = 1,
    };
}

static void announce(const struct ggn_session *s)
{
    if (!s->plan->progress)
        return;
    fprintf(s->plan->progress,
            "%d scenes; blocks: %d training (+ %d synthetic), %d validation; windows: %d training, %d validation; levels "
            "from %g, %s %g%s\n",
            s->set.data.n_scenes, ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 0) - ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1),
            ggn_series_set_count(&s->set, GGN_SPLIT_VALIDATION, 1), s->train.n, s->validation.n, s->set.first_spp,
            s->set.ratio > 0 ? "ratio" : "step", s->set.ratio > 0 ? s->set.ratio : s->set.step_spp,
            s->set.n_levels ? " behind those of the recording" : "");
    if (!s->validation.n)
        fprintf(s->plan->progress, "no validation windows: the last epoch counts and p stays uncalibrated\n");
}

int ggn_train(const struct ggn_train_plan *plan, struct base_err *err)
{
    const int lull = plan->hyper.preset == GGN_PRESET_LULL;
    struct ggn_session s = {.plan = plan, .progress.phase = lull ? GGN_PHASE_DENOISER : GGN_PHASE_CLASSIFIER};
    snprintf(s.checkpoint_path, sizeof s.checkpoint_path, "%s.ckpt", plan->out);
    int rc = ggn_resume_open(&s, err);
    if (!rc)
        rc = ggn_session_init(&s, err);
    if (!rc)
        announce(&s);
    if (!rc && plan->init)
        rc = ggn_session_load_init(&s, err);
    if (!rc && s.progress.phase == GGN_PHASE_DENOISER)
        rc = ggn_phase_denoiser(&s, err);
    if (!rc)
        rc = ggn_phase_classifier(&s, err);
    if (!rc)
        rc = ggn_session_finish(&s, err);
    ggn_session_release(&s);
    return rc;
}
