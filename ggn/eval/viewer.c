#include "eval/viewer.h"

#include <stdlib.h>

void ggn_viewer_release(struct ggn_viewer *v)
{
    (v->precision == GGN_PRECISION_F64 ? ggn_inference_destroy_f64 : ggn_inference_destroy)(v->inference);
    free(v->denoised[0]);
    *v = (struct ggn_viewer){0};
}

static int make_networks(struct ggn_viewer *v, const struct ggn_model *model, struct base_err *err)
{
    const float *learned[GGN_NETS];

    if (v->precision == GGN_PRECISION_F64 && (v->set->width != model->hyper.width || v->set->height != model->hyper.height))
        return base_fail(err, BASE_EINVAL, "in double precision only blocks of the network's size, %dx%d, are judged",
                         model->hyper.width, model->hyper.height);
    for (int net = 0; net < GGN_NETS; net++)
        learned[net] = model->weights[net]->params;
    v->inference = v->precision == GGN_PRECISION_F64 ? ggn_inference_create_f64(&model->hyper, model->graph, learned, err)
                                                     : ggn_inference_create(model, NULL, err);
    return v->inference ? 0 : err->code;
}

int ggn_viewer_init(struct ggn_viewer *v, const struct ggn_model *model, enum ggn_precision precision,
                    const struct ggn_series_set *set, struct base_err *err)
{
    size_t values = ggn_series_set_values(set);

    *v = (struct ggn_viewer){.set = set,
                             .precision = precision,
                             .window = model->hyper.window,
                             .noise_maps = set->noise_maps && model->hyper.noise_map && model->hyper.reach > 0};
    if (make_networks(v, model, err))
        return err->code;
    v->denoised[0] = malloc((size_t)v->window * values * sizeof *v->denoised[0]);
    if (!v->denoised[0]) {
        ggn_viewer_release(v);
        return base_fail_nomem(err, "evaluation");
    }
    for (int i = 1; i < v->window; i++)
        v->denoised[i] = v->denoised[0] + (size_t)i * values;
    return 0;
}

void ggn_viewer_turn(struct ggn_viewer *v, const struct ggn_level_series *series)
{
    v->series = series;
    for (int i = 0; i < v->window; i++)
        v->holds[i] = -1;
}

static int is_in(int level, const int *levels, int n)
{
    for (int i = 0; i < n; i++)
        if (levels[i] == level)
            return 1;
    return 0;
}

/* Where a level's denoised image is; one that is not among the n that are needed makes room. */
static uint16_t *denoised(struct ggn_viewer *v, int level, const int *needed, int n)
{
    const uint8_t *noisy = v->series->noisy + ggn_series_set_values(v->set) * (size_t)level;
    int spare = 0;

    for (int i = 0; i < v->window; i++) {
        if (v->holds[i] == level)
            return v->denoised[i];
        if (!is_in(v->holds[i], needed, n))
            spare = i;
    }
    (v->precision == GGN_PRECISION_F64 ? ggn_inference_denoise_f64 : ggn_inference_denoise)(
        v->inference, noisy, v->denoised[spare], v->set->width, v->set->height);
    v->holds[spare] = level;
    return v->denoised[spare];
}

/* The scalars of a window for a residual model. */
static void fill_scalars(const struct ggn_viewer *v, const int *levels, float scalars[GGN_SCALARS])
{
    struct ggn_measure window[GGN_WINDOW_MAX];
    double spp[GGN_WINDOW_MAX];

    for (int i = 0; i < v->window; i++) {
        window[i] = v->series->measure[levels[i]];
        spp[i] = v->series->spp[levels[i]];
    }
    ggn_measure_scalars(window, spp, v->window, v->law[levels[v->window - 1]], scalars);
}

double ggn_viewer_logit(void *viewer, const int *levels)
{
    struct ggn_viewer *v = viewer;
    const uint8_t *noisy[GGN_WINDOW_MAX];
    const uint16_t *clean[GGN_WINDOW_MAX];

    for (int i = 0; i < v->window; i++) {
        noisy[i] = v->series->noisy + ggn_series_set_values(v->set) * (size_t)levels[i];
        clean[i] = denoised(v, levels[i], levels, v->window);
    }
    const int last = levels[v->window - 1];
    const size_t pixels = ggn_series_set_values(v->set) / 3;
    const uint8_t *noise_map =
        v->noise_maps && v->series->has_noise_map[last] ? v->series->noise_map + pixels * (size_t)last : NULL;
    float scalars[GGN_SCALARS] = {0};
    if (v->law)
        fill_scalars(v, levels, scalars);
    return (v->precision == GGN_PRECISION_F64 ? ggn_inference_logit_f64 : ggn_inference_logit)(
        v->inference, noisy, clean, noise_map, scalars, v->set->width, v->set->height);
}
