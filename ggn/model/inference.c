#include "model/inference.h"

#include <math.h>
#include <stdlib.h>

#include "model/window.h"
#include "nn/exec.h"
#include "nn/real.h"

struct ggn_inference {
    struct ggn_hyper hyper;
    const struct ggn_graph *graph;         /* [GGN_NETS]; borrows */
    struct ggn_weights *weights[GGN_NETS]; /* the model's, borrowed; in double its own */
    struct ggn_exec *exec[GGN_NETS];
};

/* Without weights. */
static struct ggn_inference *create(const struct ggn_hyper *hyper, const struct ggn_graph *graph,
                                    struct base_threads *threads, struct base_err *err)
{
    struct ggn_inference *j = calloc(1, sizeof *j);
    if (!j) {
        base_fail_nomem(err, sizeof(real) == sizeof(float) ? "judge" : "networks in double precision");
        return NULL;
    }
    j->hyper = *hyper;
    j->graph = graph;
    for (int net = 0; net < GGN_NETS; net++) {
        j->exec[net] = ggn_exec_create(&graph[net], NULL, 1, 0, threads, err);
        if (!j->exec[net]) {
            ggn_inference_destroy(j);
            return NULL;
        }
    }
    return j;
}

#ifndef GGN_DOUBLE
size_t ggn_inference_bytes(const struct ggn_model *model, int threads)
{
    size_t bytes = sizeof(struct ggn_inference);
    for (int net = 0; net < GGN_NETS; net++)
        bytes += ggn_exec_bytes(&model->graph[net], 1, 0, threads);
    return bytes;
}

struct ggn_inference *ggn_inference_create(const struct ggn_model *model, struct base_threads *threads, struct base_err *err)
{
    struct ggn_inference *j = create(&model->hyper, model->graph, threads, err);
    for (int net = 0; j && net < GGN_NETS; net++)
        j->weights[net] = model->weights[net];
    return j;
}
#else
struct ggn_inference *ggn_inference_create_f64(const struct ggn_hyper *hyper, const struct ggn_graph *graph,
                                               const float *const *learned, struct base_err *err)
{
    struct ggn_inference *j = create(hyper, graph, NULL, err);
    for (int net = 0; j && net < GGN_NETS; net++) {
        j->weights[net] = ggn_weights_create(&graph[net], NULL, 0, err);
        if (!j->weights[net]) {
            ggn_inference_destroy(j);
            return NULL;
        }
        ggn_weights_copy(j->weights[net], learned[net]);
    }
    return j;
}
#endif

void ggn_inference_destroy(struct ggn_inference *j)
{
    for (int net = 0; j && net < GGN_NETS; net++) {
        ggn_exec_destroy(j->exec[net]);
        if (sizeof(real) == sizeof(double))
            ggn_weights_destroy(j->weights[net]);
    }
    free(j);
}

static const struct ggn_value *input(const struct ggn_inference *j, int net) { return &j->graph[net].value[0]; }

static real *output_plane(const struct ggn_inference *j, int net) { return ggn_exec_output(j->exec[net], 0, 0); }

static void forward(struct ggn_inference *j, int net) { ggn_exec_forward(j->exec[net], j->weights[net], 1, GGN_EVAL); }

void ggn_inference_denoise(struct ggn_inference *j, const uint8_t *noisy, uint16_t *denoised, int width, int height)
{
    const struct ggn_value *in = input(j, GGN_NET_R), *out = ggn_graph_output(&j->graph[GGN_NET_R]);
    const int nx = ggn_tile_count(width, in->w), ny = ggn_tile_count(height, in->h);
    for (int t = 0; t < nx * ny; t++) {
        int x0 = ggn_tile_start(width, in->w, t % nx), y0 = ggn_tile_start(height, in->h, t / nx);
        ggn_tile_load_u8(noisy, 3, width, height, x0, y0, (real)1 / 255, ggn_exec_plane(j->exec[GGN_NET_R], 0, 0, 0), in);
        forward(j, GGN_NET_R);
        ggn_tile_store_u16(denoised, width, height, x0, y0, output_plane(j, GGN_NET_R), out);
    }
}

/* The generator's map of its present input, into plane `which` of the discriminator's input. */
static void map_into(struct ggn_inference *j, int which)
{
    forward(j, GGN_NET_M);
    ggn_exec_load(j->exec[GGN_NET_D], 0, which, output_plane(j, GGN_NET_M), ggn_graph_output(&j->graph[GGN_NET_M])->row);
}

/* The noise map, and whether there is one, into the discriminator's input. */
static void load_noise_map(struct ggn_inference *j, const uint8_t *noise_map, int width, int height, int x0, int y0)
{
    static const uint8_t there[2] = {0, 1};
    const struct ggn_value *to = input(j, GGN_NET_D);
    real *plane = ggn_exec_plane(j->exec[GGN_NET_D], 0, 0, 2), *flag = ggn_exec_plane(j->exec[GGN_NET_D], 0, 0, 3);
    if (noise_map)
        ggn_tile_load_u8(noise_map, 1, width, height, x0, y0, GGN_NOISE_MAP_GAIN, plane, to);
    else
        ggn_tile_load_u8(&there[0], 1, 1, 1, 0, 0, 1, plane, to);
    ggn_tile_load_u8(&there[noise_map != NULL], 1, 1, 1, 0, 0, 1, flag, to);
}

static double tile_logit(struct ggn_inference *j, const uint8_t *const *noisy, const uint16_t *const *denoised,
                         const uint8_t *noise_map, const float *scalars, int width, int height, int x0, int y0)
{
    const struct ggn_value *in = input(j, GGN_NET_M);
    for (int k = 0; k < j->hyper.window; k++)
        ggn_tile_load_u16(denoised[k], 3, width, height, x0, y0, (real)1 / 65535,
                          ggn_exec_plane(j->exec[GGN_NET_M], 0, 0, 3 * k), in);
    map_into(j, 0);
    for (int k = 0; k < j->hyper.window; k++)
        ggn_tile_load_u8(noisy[k], 3, width, height, x0, y0, (real)1 / 255, ggn_exec_plane(j->exec[GGN_NET_M], 0, 0, 3 * k),
                         in);
    map_into(j, 1);
    if (j->hyper.noise_map)
        load_noise_map(j, noise_map, width, height, x0, y0);
    for (int i = 0; i < j->hyper.scalars; i++)
        ggn_exec_plane(j->exec[GGN_NET_D], GGN_D_SCALARS, 0, 0)[i] = (real)scalars[i];
    forward(j, GGN_NET_D);
    return (double)*output_plane(j, GGN_NET_D);
}

double ggn_inference_logit(struct ggn_inference *j, const uint8_t *const *noisy, const uint16_t *const *denoised,
                           const uint8_t *noise_map, const float *scalars, int width, int height)
{
    const struct ggn_value *in = input(j, GGN_NET_M);
    const int nx = ggn_tile_count(width, in->w), ny = ggn_tile_count(height, in->h);
    double highest = 0;
    for (int k = 0; k < j->hyper.window; k++)
        if (!ggn_fixed_is_finite(denoised[k], 3 * (size_t)width * (size_t)height))
            return (double)NAN;
    for (int t = 0; t < nx * ny; t++) {
        double z = tile_logit(j, noisy, denoised, noise_map, scalars, width, height, ggn_tile_start(width, in->w, t % nx),
                              ggn_tile_start(height, in->h, t / nx));
        if (!isfinite(z))
            return z;
        highest = t == 0 || z > highest ? z : highest;
    }
    return highest;
}
