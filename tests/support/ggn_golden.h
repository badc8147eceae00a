/*
 * The golden values: what the published networks give for weights and windows that a hash defines, in either precision.
 *
 * Formulas of weights and windows: ggn/README.md.
 */
#ifndef SUPPORT_GGN_GOLDEN_H
#define SUPPORT_GGN_GOLDEN_H

#include "base/threads.h"
#include "model/trainer.h"

enum { GGN_GOLDEN_WINDOWS = 4, GGN_GOLDEN_STAGES = 24 };

struct ggn_golden_train {
    struct ggn_paper_record step;
    double d_prob_before[4], d_prob_after[4];
    double sum_params[GGN_NETS], sum_running_mean[GGN_NETS], sum_running_var[GGN_NETS];
};

struct ggn_golden {
    double x_first, x_last, x_mean;
    double denoiser_mean, denoiser_std;
    double denoiser_at[3]; /* image 0 R (0,0), image 0 R (100,100), last image B (199,199) */
    double generator_noisy_mean, generator_noisy_std, generator_noisy_at[3];
    double generator_denoised_mean, generator_denoised_std, generator_denoised_at;
    struct {
        const char *name;
        double rms;
    } stage[GGN_GOLDEN_STAGES];
    int n_stages;
    double logit[GGN_GOLDEN_WINDOWS], p[GGN_GOLDEN_WINDOWS];
    double ssim[4]; /* x0, x2, x5, denoised0 against the reference of window 0 */
    struct ggn_golden_train train;
};

struct ggn_golden_seeds {
    uint32_t base[GGN_NETS]; /* 100, 300, 500 by default */
};

/* Pixel value of window w, image i (−1: the reference), channel c. */
double ggn_golden_pixel(int w, int i, int c, int y, int x);

/* `train_step` != 0 also makes one published iteration. */
int ggn_golden_run(const struct ggn_golden_seeds *seeds, int train_step, struct base_threads *threads,
                   struct ggn_golden *out, struct base_err *err);
/* In double. */
int ggn_golden_run_f64(const struct ggn_golden_seeds *seeds, int train_step, struct base_threads *threads,
                       struct ggn_golden *out, struct base_err *err);

#endif
