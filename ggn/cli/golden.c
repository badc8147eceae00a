/* `ggn golden`: what the published networks give for weights that a hash defines; the same figures from any implementation.
 */
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "cli/commands.h"
#include "model/golden.h"

struct options {
    struct ggn_golden_seeds seeds;
    int train_step, single, bf16, threads;
};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"base-r", 0, "N", TO(seeds.base[GGN_NET_R]), 0, UINT32_MAX, .help = "seed of the denoiser's weights (100)"},
    {"base-m", 0, "N", TO(seeds.base[GGN_NET_M]), 0, UINT32_MAX, .help = "seed of the generator's weights (300)"},
    {"base-d", 0, "N", TO(seeds.base[GGN_NET_D]), 0, UINT32_MAX, .help = "seed of the discriminator's weights (500)"},
    {"train-step", 0, NULL, TO(train_step), .help = "also make one published training iteration and report it"},
    {"float", 0, NULL, TO(single), .help = "the single-precision networks that inference and training use, not the double ones"},
    {"bf16", 0, NULL, TO(bf16), .help = "as --float, with bfloat16 products where the processor has them"},
    {"threads", 0, "N", TO(threads), 1, 1024, .help = "threads (all processors); the figures do not depend on it"},
    {0}};

static void add_number(cJSON *to, const char *name, double value)
{
    char text[40];
    snprintf(text, sizeof text, "%.12g", value);
    if (name)
        cJSON_AddRawToObject(to, name, text);
    else
        cJSON_AddItemToArray(to, cJSON_CreateRaw(text));
}

static void add_array(cJSON *to, const char *name, const double *value, int n)
{
    cJSON *array = cJSON_AddArrayToObject(to, name);
    for (int i = 0; i < n; i++)
        add_number(array, NULL, value[i]);
}

static void add_nets(cJSON *to, const char *name, const double value[GGN_NETS])
{
    static const char *const net[GGN_NETS] = {"r", "m", "d"};
    cJSON *object = cJSON_AddObjectToObject(to, name);
    for (int i = 0; i < GGN_NETS; i++)
        add_number(object, net[i], value[i]);
}

static void add_train(cJSON *j, const struct ggn_golden_train *t)
{
    add_array(j, "denoiser_loss", t->denoiser_loss, 6);
    add_number(j, "denoiser_grad_l2", t->denoiser_grad_l2);
    add_array(j, "d_prob_before", t->d_prob_before, 4);
    add_number(j, "bce_before", t->bce_before);
    add_number(j, "d_grad_l2", t->d_grad_l2);
    add_number(j, "m_grad_l2", t->m_grad_l2);
    add_array(j, "d_prob_after", t->d_prob_after, 4);
    add_number(j, "bce_after", t->bce_after);
    add_number(j, "m_grad_l2_accumulated", t->m_grad_l2_accumulated);
    add_nets(j, "sum_params", t->sum_params);
    add_nets(j, "sum_running_mean", t->sum_running_mean);
    add_nets(j, "sum_running_var", t->sum_running_var);
}

static cJSON *to_json(const struct ggn_golden *g, int train_step)
{
    static const char *const ssim_name[4] = {"x0", "x2", "x5", "denoised0"};
    cJSON *j = cJSON_CreateObject();

    add_number(j, "x_first", g->x_first);
    add_number(j, "x_last", g->x_last);
    add_number(j, "x_mean", g->x_mean);
    add_number(j, "denoiser_mean", g->denoiser_mean);
    add_number(j, "denoiser_std", g->denoiser_std);
    add_array(j, "denoiser_at", g->denoiser_at, 3);
    add_number(j, "generator_noisy_mean", g->generator_noisy_mean);
    add_number(j, "generator_noisy_std", g->generator_noisy_std);
    add_array(j, "generator_noisy_at", g->generator_noisy_at, 3);
    add_number(j, "generator_denoised_mean", g->generator_denoised_mean);
    add_number(j, "generator_denoised_std", g->generator_denoised_std);
    add_number(j, "generator_denoised_at", g->generator_denoised_at);
    cJSON *stages = cJSON_AddObjectToObject(j, "stage_rms");
    for (int i = 0; i < g->n_stages; i++)
        add_number(stages, g->stage[i].name, g->stage[i].rms);
    add_array(j, "logit", g->logit, 4);
    add_array(j, "p", g->p, 4);
    cJSON *ssim = cJSON_AddObjectToObject(j, "ssim");
    for (int i = 0; i < 4; i++)
        add_number(ssim, ssim_name[i], g->ssim[i]);
    if (train_step)
        add_train(j, &g->train);
    return j;
}

int ggn_cmd_golden(int argc, char **argv)
{
    static const struct base_options options = {
        .list = list, .doc = "Prints the golden values of the published networks as one JSON object."};
    struct options o = {.seeds = {{100, 300, 500}}, .threads = base_threads_available()};
    struct ggn_golden golden;
    struct base_err err = {0};

    struct base_threads *threads =
        base_options_parse(&options, argc, argv, &o, &err) ? NULL : base_threads_create(o.threads, &err);
    if (!threads)
        return ggn_cmd_fail(argv[0], &err);
    int rc = (o.single || o.bf16 ? ggn_golden_run : ggn_golden_run_f64)(&o.seeds, o.train_step, o.bf16, threads, &golden, &err);
    base_threads_destroy(threads);
    if (rc)
        return ggn_cmd_fail(argv[0], &err);

    cJSON *json = to_json(&golden, o.train_step);
    char *text = cJSON_Print(json);
    cJSON_Delete(json);
    if (!text) {
        base_fail_nomem(&err, "JSON");
        return ggn_cmd_fail(argv[0], &err);
    }
    puts(text);
    cJSON_free(text);
    return GGN_EXIT_OK;
}
