#include "nn/exec.h"

#include "base/clock.h"
#include "nn/layers.h"
#include "nn/real.h"
#include "nn/winograd.h"

enum { ALIGN_BYTES = 64 };

/* Where values start among the activations of one image; returns their total. */
static size_t place_values(const struct ggn_graph *g, int flags, size_t offset[GGN_MAX_LAYERS + 1])
{
    if (!(flags & (GGN_EXEC_GRADS | GGN_EXEC_NO_FUSE)))
        return ggn_graph_place(g, offset);
    for (int i = 0; i < g->n_values; i++)
        offset[i] = g->value[i].offset;
    return g->n_acts;
}

static size_t most(size_t a, size_t b) { return a > b ? a : b; }

/* Of an executor whose graph, kernels, capacity and flags are set: where values start, and the sizes of arrays; returns the
 * bytes of all. */
static size_t size_up(struct ggn_exec *e, int workers, size_t *n_sums)
{
    const struct ggn_graph *g = e->graph;
    const int back = e->flags & GGN_EXEC_GRADS;
    const size_t images = (size_t)e->capacity;
    size_t normed = 0;
    e->n_acts = place_values(g, e->flags, e->offset);
    /* of a worker: the lane sums of one weight gradient task, or one task of Winograd's form; vectors have <= 64 bytes */
    e->scratch_size = (size_t)GGN_TILE_MAX * GGN_GRAD_IC * 9 * (64 / sizeof(real)) + 256;
    for (int i = 0; i < g->n_layers; i++) {
        const struct ggn_layer *l = &g->layer[i];
        const struct ggn_value *v = &g->value[l->out];
        const int c_in = ggn_layer_c_in(g, l);
        if (l->op == GGN_OP_BN)
            normed = most(normed, (size_t)v->c);
        if (l->op == GGN_OP_CONV && back)
            e->leaf_size = most(e->leaf_size, ggn_conv_weights(g, l));
        if (l->op != GGN_OP_CONV || l->kernel != 3 || !e->kernels->wino)
            continue;
        if (ggn_wino_suits(c_in, v->c, v->h, v->w, e->kernels->lanes))
            e->scratch_size = most(e->scratch_size, ggn_wino_scratch(back && v->c > c_in ? v->c : c_in));
        if (back)
            e->scratch_size = most(e->scratch_size, GGN_WINO_GRAD_SCRATCH);
    }
    e->scratch_size = (e->scratch_size + 15) / 16 * 16;
    *n_sums = 2 * normed * (images + 1);
    return sizeof *e + *n_sums * sizeof(double) +
           sizeof(real) * (e->n_acts * images * (back ? 2 : 1) + 2 * (g->n_stats + 16) + e->scratch_size * (size_t)workers +
                           e->leaf_size * images);
}

size_t ggn_exec_bytes(const struct ggn_graph *g, int capacity, int flags, int workers)
{
    struct ggn_exec e = {.graph = g, .kernels = ggn_kernels_best(), .capacity = capacity, .flags = flags};
    size_t n_sums;
    return size_up(&e, workers, &n_sums);
}

struct ggn_exec *ggn_exec_create(const struct ggn_graph *graph, const struct ggn_kernels *kernels, int capacity, int flags,
                                 struct base_threads *threads, struct base_err *err)
{
    const int workers = threads ? base_threads_count(threads) : 1;
    struct ggn_exec plan = {.graph = graph,
                            .kernels = kernels ? kernels : ggn_kernels_best(),
                            .threads = threads,
                            .capacity = capacity,
                            .flags = flags};
    size_t n_sums;
    const size_t bytes = size_up(&plan, workers, &n_sums), acts = plan.n_acts * (size_t)capacity;
    /* calloc: fresh pages are zero already, and the zero padding of the layout is never written with anything else */
    struct ggn_exec *e = calloc(1, bytes + ALIGN_BYTES);
    if (!e) {
        base_fail_nomem(err, "network activations");
        return NULL;
    }
    *e = plan;
    e->sums = (double *)(void *)(e + 1);
    char *memory = (char *)(e->sums + n_sums);
    e->acts = (real *)(void *)(memory + (ALIGN_BYTES - (size_t)memory % ALIGN_BYTES) % ALIGN_BYTES);
    e->scratch = e->acts + acts;
    if (flags & GGN_EXEC_GRADS) {
        e->grads = e->scratch;
        e->scratch += acts;
    }
    e->bn_mean = e->scratch + e->scratch_size * (size_t)workers;
    e->bn_inv = e->bn_mean + graph->n_stats + 16;
    e->leaves = e->bn_inv + graph->n_stats + 16;
    return e;
}

#define PASSES(op, name, text) [GGN_OP_##op] = &GGN_LAYER(name),
static const struct ggn_layer_passes *const passes[] = {GGN_OPS(PASSES)};

/* The batch norm that layer i, a convolution, can apply itself when nobody else reads its output. */
static const struct ggn_layer *fusible_bn(const struct ggn_exec *e, int i)
{
    const struct ggn_layer *l = &e->graph->layer[i];
    if (e->mode != GGN_EVAL || (e->flags & (GGN_EXEC_GRADS | GGN_EXEC_NO_FUSE)) || l->op != GGN_OP_CONV ||
        i + 1 >= e->graph->n_layers || l[1].op != GGN_OP_BN || l[1].in != l->out || e->graph->value[l->out].uses != 1)
        return NULL;
    return l + 1;
}

void ggn_exec_forward(struct ggn_exec *e, struct ggn_weights *weights, int batch, enum ggn_mode mode)
{
    e->mode = mode;
    e->batch = batch;
    for (int i = 0; i < e->graph->n_layers; i++) {
        struct ggn_task t = {.e = e, .w = weights, .l = &e->graph->layer[i], .bn = fusible_bn(e, i)};
        double start = e->layer_s ? base_clock_wall_s() : 0;
        passes[t.l->op]->forward(&t);
        if (e->layer_s)
            e->layer_s[i] += base_clock_wall_s() - start;
        i += t.bn != NULL;
    }
}

void ggn_exec_backward(struct ggn_exec *e, const struct ggn_weights *weights, real *params_grad)
{
    e->params_grad = params_grad;
    for (int i = e->graph->n_layers - 1; i >= 0; i--) {
        struct ggn_task t = {.e = e, .w = (struct ggn_weights *)(size_t)weights, .l = &e->graph->layer[i], .back = 1};
        passes[t.l->op]->backward(&t);
    }
}
