#define GGN_DOUBLE
#include "model/exact.h"

#include <math.h>
#include <stdlib.h>

#include "model/window.h"
#include "nn/exec.h"

struct ggn_exact {
    struct ggn_hyper hyper;
    const struct ggn_graph *graph; /* [GGN_NETS]; borrows */
    struct ggn_weights *weights[GGN_NETS];
    struct ggn_exec *exec[GGN_NETS];
};

void ggn_exact_destroy(struct ggn_exact *e)
{
    for (int net = 0; e && net < GGN_NETS; net++) {
        ggn_exec_destroy(e->exec[net]);
        ggn_weights_destroy(e->weights[net]);
    }
    free(e);
}

static int add_network(struct ggn_exact *e, int net, const float *learned, struct base_err *err)
{
    const struct ggn_graph *g = &e->graph[net];
    double *wide = malloc(g->n_learned * sizeof *wide);

    if (!wide)
        return base_fail_nomem(err, "networks in double precision");
    for (size_t i = 0; i < g->n_learned; i++)
        wide[i] = (double)learned[i];
    e->weights[net] = ggn_weights_create(g, NULL, 0, err);
    if (e->weights[net])
        ggn_weights_copy(e->weights[net], wide);
    free(wide);
    e->exec[net] = e->weights[net] ? ggn_exec_create(g, NULL, 1, 0, NULL, err) : NULL;
    return e->exec[net] ? 0 : err->code;
}

struct ggn_exact *ggn_exact_create(const struct ggn_hyper *hyper, const struct ggn_graph *graph, const float *const *learned,
                                   struct base_err *err)
{
    struct ggn_exact *e = calloc(1, sizeof *e);

    if (!e) {
        base_fail_nomem(err, "networks in double precision");
        return NULL;
    }
    e->hyper = *hyper;
    e->graph = graph;
    for (int net = 0; net < GGN_NETS; net++)
        if (add_network(e, net, learned[net], err)) {
            ggn_exact_destroy(e);
            return NULL;
        }
    return e;
}

/* Plane c of input `net`: codes · scale; codes NULL: `scale` everywhere. */
static void load(const struct ggn_exact *e, int net, int c, const uint8_t *codes, const uint16_t *fixed, double scale)
{
    const struct ggn_value *v = &e->graph[net].value[0];
    real *to = ggn_exec_plane(e->exec[net], 0, 0, c);

    for (int y = 0; y < v->h; y++)
        for (int x = 0; x < v->w; x++) {
            size_t i = (size_t)y * (size_t)v->w + (size_t)x;
            to[(size_t)y * (size_t)v->row + (size_t)x] = scale * (codes ? codes[i] : fixed ? fixed[i] : 1);
        }
}

void ggn_exact_denoise(struct ggn_exact *e, const uint8_t *noisy, uint16_t *denoised)
{
    const struct ggn_value *v = ggn_graph_output(&e->graph[GGN_NET_R]);
    const size_t pixels = (size_t)v->w * (size_t)v->h;

    for (int c = 0; c < 3; c++)
        load(e, GGN_NET_R, c, noisy + (size_t)c * pixels, NULL, 1.0 / 255);
    ggn_exec_forward(e->exec[GGN_NET_R], e->weights[GGN_NET_R], 1, GGN_EVAL);
    for (int c = 0; c < 3; c++) {
        const real *from = ggn_exec_output(e->exec[GGN_NET_R], 0, c);
        for (int y = 0; y < v->h; y++)
            for (int x = 0; x < v->w; x++) {
                double p = from[(size_t)y * (size_t)v->row + (size_t)x], code = floor(fmax(p, 0) * GGN_FIXED_ONE + 0.5);
                denoised[(size_t)c * pixels + (size_t)y * (size_t)v->w + (size_t)x] =
                    isnan(p) ? GGN_FIXED_NAN : (uint16_t)fmin(code, GGN_FIXED_NAN - 1);
            }
    }
}

/* The generator's map of its present input, into plane c of the discriminator's. */
static void map_into(struct ggn_exact *e, int c)
{
    ggn_exec_forward(e->exec[GGN_NET_M], e->weights[GGN_NET_M], 1, GGN_EVAL);
    ggn_exec_load(e->exec[GGN_NET_D], 0, c, ggn_exec_output(e->exec[GGN_NET_M], 0, 0),
                  ggn_graph_output(&e->graph[GGN_NET_M])->row);
}

double ggn_exact_logit(struct ggn_exact *e, const uint8_t *const *noisy, const uint16_t *const *denoised,
                       const uint8_t *noise_map, const float *scalars)
{
    const size_t pixels = (size_t)e->hyper.width * (size_t)e->hyper.height;

    for (int k = 0; k < e->hyper.window; k++)
        if (!ggn_fixed_is_finite(denoised[k], 3 * pixels))
            return (double)NAN;
    for (int i = 0; i < 3 * e->hyper.window; i++)
        load(e, GGN_NET_M, i, NULL, denoised[i / 3] + (size_t)(i % 3) * pixels, 1.0 / 65535);
    map_into(e, 0);
    for (int i = 0; i < 3 * e->hyper.window; i++)
        load(e, GGN_NET_M, i, noisy[i / 3] + (size_t)(i % 3) * pixels, NULL, 1.0 / 255);
    map_into(e, 1);
    if (e->hyper.noise_map) {
        load(e, GGN_NET_D, 2, noise_map, NULL, noise_map ? (double)GGN_NOISE_MAP_GAIN : 0);
        load(e, GGN_NET_D, 3, NULL, NULL, noise_map ? 1 : 0);
    }
    for (int i = 0; i < e->hyper.scalars; i++)
        ggn_exec_plane(e->exec[GGN_NET_D], GGN_D_SCALARS, 0, 0)[i] = (double)scalars[i];
    ggn_exec_forward(e->exec[GGN_NET_D], e->weights[GGN_NET_D], 1, GGN_EVAL);
    return *ggn_exec_output(e->exec[GGN_NET_D], 0, 0);
}
