/* One forward and backward pass of a network in training mode, by the kernels of one instruction set and precision. */
#ifndef TESTS_SUPPORT_GGN_NETWORK_RUN_H
#define TESTS_SUPPORT_GGN_NETWORK_RUN_H

#include "base/threads.h"
#include "nn/graph.h"
#include "base/isa.h"

struct ggn_network_pass {
    double *y, *dx, *grad; /* [batch] outputs and input gradients without gaps, [n_params]; owns */
    size_t n_y, n_dx, n_grad;
};

/* params [n_params], or NULL for hashed ones; x, dy: [batch] inputs and gradients of the output, without gaps. */
struct ggn_network_pass ggn_network_run(const struct ggn_graph *g, enum base_isa isa, int batch,
                                        struct base_threads *threads, const double *params, const double *x,
                                        const double *dy);
/* In double. */
struct ggn_network_pass ggn_network_run_f64(const struct ggn_graph *g, enum base_isa isa, int batch,
                                            struct base_threads *threads, const double *params, const double *x,
                                            const double *dy);

#endif
