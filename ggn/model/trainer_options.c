#include "model/trainer.h"

struct ggn_train_options ggn_train_options_default(enum ggn_preset preset)
{
    int lull = preset == GGN_PRESET_LULL;
    enum ggn_init plain = lull ? GGN_INIT_HE : GGN_INIT_PAPER;

    return (struct ggn_train_options){
        .parts = GGN_TRAIN_ALL,
        .batch = lull ? 16 : 64,
        .lr = {2e-4, 2e-4, 2e-4},
        .beta1 = 0.5,
        .beta2 = 0.999,
        .eps = 1e-8,
        .clip = lull ? 1 : 0,
        .explode = 1e6,
        .dropout = 1,
        .init = {plain, plain, lull ? GGN_INIT_HE : GGN_INIT_GAN},
        .seed = 1,
    };
}
