#include "support/ggn_network_run.h"

#include <assert.h>
#include <stdlib.h>

#include "nn/exec.h"
#include "nn/real.h"

/* Element k of the values that a batch holds without gaps. */
static real *element(const struct ggn_exec *e, int value, int gradient, size_t k)
{
    const struct ggn_value *v = &e->graph->value[value];
    const size_t area = (size_t)v->h * (size_t)v->w;
    const int image = (int)(k / area) / v->c, c = (int)(k / area) % v->c, at = (int)(k % area);
    real *plane = gradient ? ggn_exec_grad(e, value, image, c) : ggn_exec_plane(e, value, image, c);

    return plane + (long)(at / v->w) * v->row + at % v->w;
}

static size_t elements(const struct ggn_value *v, int batch)
{
    return (size_t)batch * (size_t)v->c * (size_t)v->h * (size_t)v->w;
}

struct ggn_network_pass GGN_TYPED(ggn_network_run)(const struct ggn_graph *g, enum base_isa isa, int batch,
                                                   struct base_threads *threads, const double *params, const double *x,
                                                   const double *dy)
{
    const struct ggn_kernels *k = ggn_kernels_for(isa);
    const int out = g->n_values - 1;
    struct ggn_weights *w = ggn_weights_create(g, k, GGN_WEIGHTS_BACKWARD, NULL);
    struct ggn_exec *e = ggn_exec_create(g, k, batch, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD, threads, NULL);
    struct ggn_network_pass r = {
        .n_y = elements(&g->value[out], batch), .n_dx = elements(&g->value[0], batch), .n_grad = g->n_params};
    real *grad = calloc(g->n_params, sizeof *grad);

    r.y = calloc(r.n_y, sizeof *r.y);
    r.dx = calloc(r.n_dx, sizeof *r.dx);
    r.grad = calloc(r.n_grad, sizeof *r.grad);
    assert(w && e && grad && r.y && r.dx && r.grad);
    ggn_weights_init(w, GGN_INIT_HASH, 12);
    for (size_t i = 0; params && i < g->n_params; i++)
        w->params[i] = (real)params[i];
    ggn_weights_pack(w, NULL);
    for (size_t i = 0; i < r.n_dx; i++)
        *element(e, 0, 0, i) = (real)x[i];
    ggn_exec_forward(e, w, batch, GGN_TRAIN);
    for (size_t i = 0; i < r.n_y; i++) {
        r.y[i] = (double)*element(e, out, 0, i);
        *element(e, out, 1, i) = (real)dy[i];
    }
    ggn_exec_backward(e, w, grad);
    for (size_t i = 0; i < r.n_dx; i++)
        r.dx[i] = (double)*element(e, 0, 1, i);
    for (size_t i = 0; i < r.n_grad; i++)
        r.grad[i] = (double)grad[i];
    ggn_weights_destroy(w);
    ggn_exec_destroy(e);
    free(grad);
    return r;
}
