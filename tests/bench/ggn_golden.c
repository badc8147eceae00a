/* What the published networks give for weights that a hash defines, as JSON; the same figures from any implementation. */
#include <cjson/cJSON.h>
#include <stdio.h>

#include "base/json.h"
#include "base/options.h"
#include "support/ggn_golden.h"

struct options {
    struct ggn_golden_seeds seeds;
    int train_step, single, threads;
};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"base-r", 0, "N", TO(seeds.base[GGN_NET_R]), 0, UINT32_MAX, .help = "seed of the denoiser's weights (100)"},
    {"base-m", 0, "N", TO(seeds.base[GGN_NET_M]), 0, UINT32_MAX, .help = "seed of the generator's weights (300)"},
    {"base-d", 0, "N", TO(seeds.base[GGN_NET_D]), 0, UINT32_MAX, .help = "seed of the discriminator's weights (500)"},
    {"train-step", 0, NULL, TO(train_step), .help = "also make one published training iteration and report it"},
    {"float", 0, NULL, TO(single),
     .help = "the single-precision networks that inference and training use, not the double ones"},
    {"threads", 0, "N", TO(threads), 1, 1024, .help = "threads (all processors); the figures do not depend on it"},
    {0}};

static void add_number(cJSON *to, const char *name, double value, int *failed)
{
    char text[40];
    snprintf(text, sizeof text, "%.12g", value);
    base_json_item(to, name, cJSON_CreateRaw(text), failed);
}

static void add_array(cJSON *to, const char *name, const double *value, int n, int *failed)
{
    cJSON *array = base_json_array(to, name, failed);
    for (int i = 0; i < n; i++)
        add_number(array, NULL, value[i], failed);
}

static void add_nets(cJSON *to, const char *name, const double value[GGN_NETS], int *failed)
{
    static const char *const net[GGN_NETS] = {"r", "m", "d"};
    cJSON *object = base_json_object(to, name, failed);
    for (int i = 0; i < GGN_NETS; i++)
        add_number(object, net[i], value[i], failed);
}

static void add_train(cJSON *j, const struct ggn_golden_train *t, int *failed)
{
    add_array(j, "denoiser_loss", t->step.denoiser_loss, 6, failed);
    add_number(j, "denoiser_grad_l2", t->step.denoiser_grad_l2, failed);
    add_array(j, "d_prob_before", t->d_prob_before, 4, failed);
    add_number(j, "bce_before", t->step.bce_before, failed);
    add_number(j, "d_grad_l2", t->step.d_grad_l2, failed);
    add_array(j, "d_prob_after", t->d_prob_after, 4, failed);
    add_number(j, "bce_after", t->step.bce_after, failed);
    add_number(j, "m_grad_l2_accumulated", t->step.m_grad_l2_accumulated, failed);
    add_nets(j, "sum_params", t->sum_params, failed);
    add_nets(j, "sum_running_mean", t->sum_running_mean, failed);
    add_nets(j, "sum_running_var", t->sum_running_var, failed);
}

static cJSON *to_json(const struct ggn_golden *g, int train_step, int *failed)
{
    static const char *const ssim_name[4] = {"x0", "x2", "x5", "denoised0"};
    cJSON *j = cJSON_CreateObject();

    add_number(j, "x_first", g->x_first, failed);
    add_number(j, "x_last", g->x_last, failed);
    add_number(j, "x_mean", g->x_mean, failed);
    add_number(j, "denoiser_mean", g->denoiser_mean, failed);
    add_number(j, "denoiser_std", g->denoiser_std, failed);
    add_array(j, "denoiser_at", g->denoiser_at, 3, failed);
    add_number(j, "generator_noisy_mean", g->generator_noisy_mean, failed);
    add_number(j, "generator_noisy_std", g->generator_noisy_std, failed);
    add_array(j, "generator_noisy_at", g->generator_noisy_at, 3, failed);
    add_number(j, "generator_denoised_mean", g->generator_denoised_mean, failed);
    add_number(j, "generator_denoised_std", g->generator_denoised_std, failed);
    add_number(j, "generator_denoised_at", g->generator_denoised_at, failed);
    cJSON *stages = base_json_object(j, "stage_rms", failed);
    for (int i = 0; i < g->n_stages; i++)
        add_number(stages, g->stage[i].name, g->stage[i].rms, failed);
    add_array(j, "logit", g->logit, 4, failed);
    add_array(j, "p", g->p, 4, failed);
    cJSON *ssim = base_json_object(j, "ssim", failed);
    for (int i = 0; i < 4; i++)
        add_number(ssim, ssim_name[i], g->ssim[i], failed);
    if (train_step)
        add_train(j, &g->train, failed);
    return j;
}

static int run(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list, .doc = "Prints the golden values of the published networks as one JSON object."};
    struct options o = {.seeds = {{100, 300, 500}}, .threads = base_threads_available()};
    struct ggn_golden golden;

    struct base_threads *threads =
        base_options_parse(&options, argc, argv, &o, err) ? NULL : base_threads_create(o.threads, err);
    if (!threads)
        return err->code;
    int rc = (o.single ? ggn_golden_run : ggn_golden_run_f64)(&o.seeds, o.train_step, threads, &golden, err);
    base_threads_destroy(threads);
    if (rc)
        return rc;
    int failed = 0;
    cJSON *json = to_json(&golden, o.train_step, &failed);
    rc = base_json_write(NULL, json, failed, err);
    cJSON_Delete(json);
    return rc;
}

int main(int argc, char **argv)
{
    struct base_err err = {0};
    int rc = run(argc, argv, &err);
    if (rc)
        fprintf(stderr, "%s: %s\n", argv[0], err.text);
    return rc ? 2 : 0;
}
