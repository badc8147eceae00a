#include "model/judge.h"

#include <stdlib.h>
#include <string.h>

#include "model/window.h"
#include "nn/exec.h"

struct ggn_judge {
    const struct ggn_model *model;
    struct ggn_exec_f32 *r, *m, *d;
};

struct ggn_judge *ggn_judge_create(const struct ggn_model *model, struct ggn_threads *threads, struct ggn_err *err)
{
    struct ggn_judge *j = calloc(1, sizeof *j);

    if (!j) {
        ggn_fail_nomem(err, "judge");
        return NULL;
    }
    j->model = model;
    /* the generator's two windows, denoised and noisy, are a batch of two */
    j->r = ggn_exec_create_f32(&model->graph[GGN_NET_R], NULL, 1, 0, threads, err);
    j->m = j->r ? ggn_exec_create_f32(&model->graph[GGN_NET_M], NULL, 2, 0, threads, err) : NULL;
    j->d = j->m ? ggn_exec_create_f32(&model->graph[GGN_NET_D], NULL, 1, 0, threads, err) : NULL;
    if (j->d)
        return j;
    ggn_judge_destroy(j);
    return NULL;
}

void ggn_judge_destroy(struct ggn_judge *j)
{
    if (!j)
        return;
    ggn_exec_destroy_f32(j->r);
    ggn_exec_destroy_f32(j->m);
    ggn_exec_destroy_f32(j->d);
    free(j);
}

static const struct ggn_value *output(const struct ggn_exec_f32 *e)
{
    return &e->graph->value[e->graph->n_values - 1];
}

static float *output_plane(const struct ggn_exec_f32 *e, int image)
{
    return ggn_exec_plane_f32(e, e->graph->n_values - 1, image, 0);
}

void ggn_judge_denoise(struct ggn_judge *j, const uint8_t *noisy, uint16_t *denoised, int width, int height)
{
    const struct ggn_value *in = &j->r->graph->value[0], *out = output(j->r);
    const int nx = ggn_tile_count(width, in->w), ny = ggn_tile_count(height, in->h);

    for (int t = 0; t < nx * ny; t++) {
        int x0 = ggn_tile_start(width, in->w, t % nx), y0 = ggn_tile_start(height, in->h, t / nx);
        ggn_tile_load_u8(noisy, width, height, x0, y0, in->w, in->h, 1.0F / 255, ggn_exec_plane_f32(j->r, 0, 0, 0),
                         (size_t)in->row, in->plane);
        ggn_exec_forward_f32(j->r, j->model->weights[GGN_NET_R], 1, GGN_EVAL);
        ggn_tile_store_u16(denoised, width, height, x0, y0, in->w, in->h, output_plane(j->r, 0), (size_t)out->row,
                           out->plane);
    }
}

static double tile_logit(struct ggn_judge *j, const uint8_t *const *noisy, const uint16_t *const *denoised, int width,
                         int height, int x0, int y0)
{
    const struct ggn_value *in = &j->m->graph->value[0], *map = output(j->m), *to = &j->d->graph->value[0];

    for (int k = 0; k < j->model->hyper.window; k++) {
        ggn_tile_load_u16(denoised[k], width, height, x0, y0, in->w, in->h, 1.0F / 65535,
                          ggn_exec_plane_f32(j->m, 0, 0, 3 * k), (size_t)in->row, in->plane);
        ggn_tile_load_u8(noisy[k], width, height, x0, y0, in->w, in->h, 1.0F / 255, ggn_exec_plane_f32(j->m, 0, 1, 3 * k),
                         (size_t)in->row, in->plane);
    }
    ggn_exec_forward_f32(j->m, j->model->weights[GGN_NET_M], 2, GGN_EVAL);
    for (int which = 0; which < 2; which++)
        for (int y = 0; y < map->h; y++)
            memcpy(ggn_exec_plane_f32(j->d, 0, 0, which) + (long)y * to->row, output_plane(j->m, which) + (long)y * map->row,
                   (size_t)map->w * sizeof(float));
    ggn_exec_forward_f32(j->d, j->model->weights[GGN_NET_D], 1, GGN_EVAL);
    return (double)*output_plane(j->d, 0);
}

double ggn_judge_logit(struct ggn_judge *j, const uint8_t *const *noisy, const uint16_t *const *denoised, int width,
                       int height)
{
    const struct ggn_value *in = &j->m->graph->value[0];
    const int nx = ggn_tile_count(width, in->w), ny = ggn_tile_count(height, in->h);
    double highest = 0;

    for (int t = 0; t < nx * ny; t++) {
        double z = tile_logit(j, noisy, denoised, width, height, ggn_tile_start(width, in->w, t % nx),
                              ggn_tile_start(height, in->h, t / nx));
        highest = t == 0 || z > highest ? z : highest;
    }
    return highest;
}

const float *ggn_judge_feature_map(const struct ggn_judge *j, int which, int *row)
{
    *row = output(j->m)->row;
    return output_plane(j->m, which);
}
