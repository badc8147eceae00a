/* `ggn train`: from a data set to a model file. */
#include "base/files.h"
#include "base/paths.h"
#include "base/interrupt.h"
#include "base/options.h"
#include "cli/commands.h"
#include "model/container.h"
#include "train/train.h"

struct settings {
    struct ggn_train_plan plan;
    int preset, quiet;
};
#define TO(member) BASE_TO(struct settings, member)
static const struct base_option list[] = {
    {"data", 'd', "DIR", TO(plan.data.dir), .input = BASE_FOLDER, .needed = 1,
     .help = "data set: a folder of recorded, labelled sequences (needed)"},
    {"out", 'o', "FILE", TO(plan.out), .needed = 1, .output = BASE_FILE, .kind = &ggn_container_kind,
     .help = "model file; FILE.ckpt, .csv and .card.json lie beside it (needed)"},
    {"preset", 0, NULL, TO(preset), .words = ggn_preset_names, .role = BASE_DECIDES,
     .help = "networks, procedure and defaults (lull)"},
    {"init", 0, "FILE", TO(plan.init), .input = BASE_FILE, .role = BASE_DECIDES, .help = "start from this model"},
    {"resume", 0, NULL, TO(plan.resume), .help = "continue from FILE.ckpt if it is there"},
    {"validation", 'V', "SCENE,...", TO(plan.data.split.validation),
     .help = "validation scenes, over the data set's split.json"},
    {"test", 'T', "SCENE,...", TO(plan.data.split.test),
     .help = "test scenes, over the data set's split.json; they are not even read"},
    {"seed", 's', "N", TO(plan.seed), 0, UINT32_MAX, .role = BASE_DECIDES, .help = "seed of everything random (1)"},
    {"quiet", 'q', NULL, TO(quiet), .help = "no progress on standard error"},
    {.help = "Defaults by preset:"},
    {"window", 0, "N", TO(plan.hyper.window), 2, 16, .role = BASE_DECIDES, .help = "images per window (6)"},
    {"kr", 0, "N", TO(plan.hyper.k_r), 3, 128, .role = BASE_DECIDES, .help = "width of the denoiser (lull 8, paper 16)"},
    {"km", 0, "N", TO(plan.hyper.k_m), 1, 128, .role = BASE_DECIDES,
     .help = "width of the feature map generator (lull 10, paper 20)"},
    {"kd", 0, "N", TO(plan.hyper.k_d), 1, 64, .role = BASE_DECIDES,
     .help = "width of the discriminator (lull 32, paper 64)"},
    {"crop", 0, "N", TO(plan.crop), 16, 1024,
     .help = "side of the denoiser's training crops, pixels (lull 96, or the side of smaller blocks)"},
    {"batch-denoiser", 0, "N", TO(plan.batch_r), 1, 1024, .role = BASE_DECIDES, .help = "crops per denoiser step (16)"},
    {"batch", 0, "N", TO(plan.batch), 1, 1024, .role = BASE_DECIDES, .help = "windows per step (lull 16, paper 64)"},
    {"steps-denoiser", 0, "N", TO(plan.steps_r), 0, 1e8, .role = BASE_DECIDES,
     .help = "steps of the denoiser phase (lull 2000)"},
    {"steps", 0, "N", TO(plan.steps), 1, 1e8, .role = BASE_DECIDES,
     .help = "steps of the generator and discriminator phase (lull 2000; paper: by epochs)"},
    {"epochs", 0, "N", TO(plan.epochs), 1, 1e6, .role = BASE_DECIDES,
     .help = "passes over all windows, preset paper only (30)"},
    {"epoch-steps", 0, "N", TO(plan.epoch_steps), 1, 1e8, .role = BASE_DECIDES,
     .help = "steps between validations and checkpoints (lull 100; paper: one pass)"},
    {"hours", 0, "HOURS", TO(plan.hours), 0, 1e6,
     .help = "end with the first validation of generator and discriminator after so many hours of processors, all sittings "
             "together, 0 = no limit (0)"},
    {"patience", 0, "N", TO(plan.patience), 0, 1e6, .role = BASE_DECIDES,
     .help = "end after so many validations without a lower loss, 0 = never (lull 8)"},
    {"lr-denoiser", 0, "N", TO(plan.lr_r), 1e-9, 1, .role = BASE_DECIDES,
     .help = "learning rate of the denoiser (lull 1e-3, paper 2e-4)"},
    {"lr", 0, "N", TO(plan.lr), 1e-9, 1, .role = BASE_DECIDES,
     .help = "learning rate of generator and discriminator (lull 1e-3, paper 2e-4)"},
    {"picture", 0, "SHARE", TO(plan.noise_map), 0, 1, .role = BASE_DECIDES,
     .help = "with --residual: share of windows that come with the picture of their visible noise, 0 = networks without "
             "that input (0)"},
    {"residual", 0, "OCTAVES", TO(plan.hyper.reach), 0, GGN_REACH_MAX, .role = BASE_DECIDES,
     .help =
         "learn to correct what the observer measures by up to so many octaves of noise, 0 = judge without it; needs half "
         "buffers at the recorded levels; preset lull only (0)"},
    {"scalars", 0, "N", TO(plan.scalars), 0, 1, .role = BASE_DECIDES,
     .help = "1: with --residual, also tell the network what was measured (lull 1)"},
    {"synthetic", 0, "N", TO(plan.synthetic), 0, 63, .role = BASE_DECIDES,
     .help = "synthetic sequences per block, made from its half buffers (lull 1)"},
    {"extend", 0, "N", TO(plan.extend), 0, 1, .role = BASE_DECIDES,
     .help = "1: continue recordings that end near their threshold with samples of the reference (lull 1)"},
    {"ratio", 0, "N", TO(plan.data.ratio), 0, 10,
     .help = "thin the recorded levels to at least this ratio, 0 = all (lull 1.1)"},
    {"validation-windows", 0, "N", TO(plan.validation_windows), 1, 1e6, .role = BASE_DECIDES,
     .help = "most windows per validation (400)"},
    {"early-rate", 0, "N", TO(plan.early_rate), 0, 1,
     .help = "share of validation blocks that the threshold may stop early (0.02)"},
    {"threads", 0, "N", TO(plan.threads), 0, 1024,
     .help = "threads, 0 = all processors; the result does not depend on it (0)"},
    {0}};

/* What training leaves beside the model has longer names, and could be what it begins with. */
static int check_beside(const struct ggn_train_plan *plan, struct base_err *err)
{
    static const char *const endings[] = {".ckpt", ".csv", ".card.json"};
    struct base_inputs inputs = BASE_INPUTS_EMPTY;
    char path[4096 + sizeof ".card.json"];
    int rc = plan->init ? base_inputs_add(&inputs, plan->init, err) : 0;
    for (size_t i = 0; i < sizeof endings / sizeof endings[0] && !rc; i++) {
        snprintf(path, sizeof path, "%s%s", plan->out, endings[i]);
        rc = base_file_check_output(path, err);
        if (!rc)
            rc = base_inputs_protect(&inputs, path, err);
        if (!rc && i == 0)
            rc = base_file_check_kind(path, &ggn_container_kind, err);
    }
    base_inputs_release(&inputs);
    return rc;
}

int ggn_cmd_train(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {.list = list,
                                                .doc = "Trains a stopping criterion on a data set of block sequences.\vThe "
                                                       "same data, options and seed give the same model bytes, also "
                                                       "after an interruption and --resume, with any number of threads."};
    struct settings s = {.preset = GGN_PRESET_LULL};
    /* Twice: the preset decides the defaults that other options override, wherever it stands. */
    int rc = base_options_parse(&options, argc, argv, &s, err);
    s.plan = ggn_train_plan_default((enum ggn_preset)s.preset);
    if (!rc)
        rc = base_options_parse(&options, argc, argv, &s, err);
    if (!rc)
        rc = check_beside(&s.plan, err);
    if (rc)
        return rc;
    s.plan.progress = s.quiet ? NULL : stderr;
    s.plan.interrupted = &base_interrupted;
    base_interrupt_catch();
    base_options_identify(list, &s, &s.plan.identity);
    rc = ggn_train(&s.plan, err);
    base_identity_release(&s.plan.identity);
    if (rc == GGN_TRAIN_INTERRUPTED) {
        fprintf(stderr, "%s: interrupted; --resume continues from the last validation\n", argv[0]);
        return GGN_EXIT_INTERRUPTED;
    }
    return rc;
}
