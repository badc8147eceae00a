/*
 * What the layers are made of; private to nn/exec*.c. Each layer of GGN_OPS defines GGN_LAYER(its name): a forward and a
 * backward pass over the batch of an executor, cut into tasks by shape only.
 */
#ifndef GGN_NN_LAYERS_H
#define GGN_NN_LAYERS_H

#include "nn/exec.h"

/* What the tasks of one layer share. */
struct ggn_task {
    struct ggn_exec *e;
    struct ggn_weights *w;
    const struct ggn_layer *l;
    int back;                                           /* the backward pass */
    void (*piece)(const struct ggn_task *task, long i); /* what is being run */
    real *scratch;                                      /* of the thread that runs a piece */
    const struct ggn_layer *bn;         /* CONV: the batch norm that follows and is applied on the way, or NULL */
    int px_blocks, oc_groups, oc_group; /* how a convolution is cut */
    int ic_groups, ic_group;            /* of its weights' gradient */
    long px_block;
    int weights_by_wino; /* CONV: the gradient of its weights */
    const real *wino;    /* CONV: transformed weights when Winograd's algorithm is used */
};

struct ggn_layer_passes {
    void (*forward)(struct ggn_task *task);
    void (*backward)(struct ggn_task *task);
};
#define GGN_LAYER(name) GGN_TYPED(ggn_layer_##name)
#define GGN_LAYER_DECLARE(op, name, text) extern const struct ggn_layer_passes GGN_LAYER(name);
GGN_OPS(GGN_LAYER_DECLARE)

static inline void ggn_task_piece(void *data, long i, int worker)
{
    struct ggn_task t = *(const struct ggn_task *)data;
    t.scratch = t.e->scratch + (size_t)worker * t.e->scratch_size;
    t.piece(&t, i);
}

/* Runs piece(task, i) for i < n, with the scratch memory of the thread in the task. */
static inline void ggn_task_run(struct ggn_task *t, long n, void (*piece)(const struct ggn_task *task, long i))
{
    t->piece = piece;
    base_threads_for(t->e->threads, n, ggn_task_piece, t);
}

/* The layer's first input and its output. */
static inline const struct ggn_value *ggn_task_in(const struct ggn_task *t) { return &t->e->graph->value[t->l->in]; }
static inline const struct ggn_value *ggn_task_out(const struct ggn_task *t) { return &t->e->graph->value[t->l->out]; }
/* Channels of both inputs together. */
static inline int ggn_task_c_in(const struct ggn_task *t) { return ggn_layer_c_in(t->e->graph, t->l); }

/* How many weights a convolution has. */
static inline size_t ggn_conv_weights(const struct ggn_graph *g, const struct ggn_layer *l)
{
    return (size_t)ggn_layer_c_in(g, l) * (size_t)g->value[l->out].c * (size_t)(l->kernel * l->kernel);
}

/* Where image n leaves the gradient of the weights of the present layer, laid out as they are. */
static inline real *ggn_leaf(const struct ggn_task *t, long n) { return t->e->leaves + (size_t)n * t->e->leaf_size; }

#endif
