#include "train/train_plan.h"

struct ggn_train_plan ggn_train_plan_default(enum ggn_preset preset)
{
    const int lull = preset == GGN_PRESET_LULL;

    return (struct ggn_train_plan){
        .data = {.ratio = lull ? 1.1 : 0},
        .preset = preset,
        .window = 6,
        .k_r = lull ? 8 : 16,
        .k_m = lull ? 10 : 20,
        .k_d = lull ? 32 : 64,
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
        .threads = 0,
    };
}
