/* Central differences in double for every layer on several shapes, and along random directions for the whole networks. */
#define GGN_DOUBLE
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/networks.h"
#include "nn/exec.h"
#include "nn/hash.h"
#include "nn/loss.h"
#include "nn/ssim.h"
#include "nn/ssim.h"

/* (L(x+h) − L(x−h)) / 2h has a truncation error of order h² and a rounding error of order 1e-16/h. */
static const double STEP = 1e-5, TOLERANCE = 2e-7;

static struct ggn_graph graph;
static struct ggn_weights *weights;
static struct ggn_exec *e;
static double *params_grad, mean0[4096], var0[4096];
static int batch, out;

static double rnd(uint32_t k, uint32_t s) { return 2 * ggn_hash_unit(k, s) - 1; }

/* The loss Σ r·y with fixed random r; running statistics are put back, so that it is a function. */
static double loss(int backward, uint32_t seed)
{
    const struct ggn_value *v = &graph.value[out];
    double total = 0;

    memcpy(weights->mean, mean0, graph.n_stats * sizeof(double));
    memcpy(weights->var, var0, graph.n_stats * sizeof(double));
    ggn_weights_pack(weights, NULL);
    ggn_exec_forward(e, weights, batch, GGN_TRAIN);
    for (int n = 0; n < batch; n++)
        for (int c = 0; c < v->c; c++)
            for (int k = 0; k < v->h * v->w; k++) {
                long at = (long)(k / v->w) * v->row + k % v->w;
                double r = rnd((uint32_t)((n * v->c + c) * v->h * v->w + k), seed + 77);
                total += r * ggn_exec_plane(e, out, n, c)[at];
                if (backward)
                    ggn_exec_grad(e, out, n, c)[at] = r;
            }
    if (backward) {
        memset(params_grad, 0, graph.n_params * sizeof *params_grad);
        ggn_exec_backward(e, weights, params_grad);
    }
    return total;
}

static void start(int images, uint32_t seed)
{
    struct base_err err = {0};

    if (ggn_graph_end(&graph, &err))
        fail_msg("%s", err.text);
    batch = images;
    out = graph.n_values - 1;
    weights = ggn_weights_create(&graph, NULL, 1, &err);
    e = ggn_exec_create(&graph, NULL, batch, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD, NULL, &err);
    params_grad = calloc(graph.n_params + 1, sizeof *params_grad);
    assert_non_null(weights);
    assert_non_null(e);
    assert_non_null(params_grad);
    ggn_weights_init(weights, GGN_INIT_HASH, seed);
    memcpy(mean0, weights->mean, graph.n_stats * sizeof(double));
    memcpy(var0, weights->var, graph.n_stats * sizeof(double));
    const struct ggn_value *v = &graph.value[0];
    for (int n = 0; n < batch; n++)
        for (int c = 0; c < v->c; c++)
            for (int k = 0; k < v->h * v->w; k++)
                ggn_exec_plane(e, 0, n, c)[(long)(k / v->w) * v->row + k % v->w] =
                    rnd((uint32_t)((n * v->c + c) * v->h * v->w + k), seed + 5);
}

static void finish(void)
{
    ggn_weights_destroy(weights);
    ggn_exec_destroy(e);
    free(params_grad);
}

static void compare(const char *what, double *x, double grad, uint32_t seed)
{
    double old = *x;

    *x = old + STEP;
    double high = loss(0, seed);
    *x = old - STEP;
    double low = loss(0, seed);
    *x = old;
    double numeric = (high - low) / (2 * STEP), scale = fmax(fabs(numeric), 1);
    if (!(fabs(numeric - grad) <= TOLERANCE * scale))
        fail_msg("%s: gradient %.10g, differences give %.10g", what, grad, numeric);
}

/* Every parameter (or a sample of them) and a sample of the inputs. */
static void check(const char *what, int images, uint32_t seed)
{
    enum { SAMPLES = 60 };

    start(images, seed);
    loss(1, seed);
    for (int i = 0; i < SAMPLES && graph.n_params; i++) {
        size_t k = graph.n_params <= SAMPLES ? (size_t)i % graph.n_params : ggn_hash((uint32_t)i, seed) % graph.n_params;
        double grad = params_grad[k];
        compare(what, &weights->params[k], grad, seed);
    }
    loss(1, seed);
    const struct ggn_value *v = &graph.value[0];
    for (int i = 0; i < SAMPLES; i++) {
        int n = (int)(ggn_hash((uint32_t)i, seed + 1) % (uint32_t)images),
            c = (int)(ggn_hash((uint32_t)i, seed + 2) % (uint32_t)v->c);
        int k = (int)(ggn_hash((uint32_t)i, seed + 3) % (uint32_t)(v->h * v->w));
        long at = (long)(k / v->w) * v->row + k % v->w;
        compare(what, ggn_exec_plane(e, 0, n, c) + at, ggn_exec_grad(e, 0, n, c)[at], seed);
    }
    finish();
}

enum { SHAPES = 6 };
static const int shape[SHAPES][3] = {{1, 1, 1}, {3, 1, 7}, {2, 5, 3}, {9, 4, 4}, {5, 13, 9}, {17, 3, 26}};

#define FOR_SHAPES(name, build) \
    static void name(void **state) \
    { \
        for (int s = 0; s < SHAPES; s++) { \
            const int c = shape[s][0], h = shape[s][1], w = shape[s][2]; \
            ggn_graph_begin(&graph, #name, c, h, w); \
            ggn_graph_stage(&graph, "a"); \
            build; \
            check(#name, 1 + s % 3, (uint32_t)(100 * s + 1)); \
        } \
        (void)state; \
    }

/* A layer that is read twice, so that gradients are added up, and one that joins. */
static void build_joined(int c)
{
    int a = ggn_graph_conv(&graph, 0, -1, c + 1, 3, 0, 0.2);
    int b = ggn_graph_conv(&graph, a, -1, 3, 1, 0, 1);
    int d = ggn_graph_conv(&graph, b, a, 2, 3, 1, 0.2);
    ggn_graph_conv(&graph, d, a, 3, 3, 0, 1);
}

FOR_SHAPES(test_conv3, ggn_graph_conv(&graph, 0, -1, 11, 3, 0, 0.2))
FOR_SHAPES(test_conv1, ggn_graph_conv(&graph, 0, -1, 3, 1, 0, 1))
FOR_SHAPES(test_conv_transposed, ggn_graph_conv(&graph, 0, -1, c == 9 ? 20 : 4, 3, 1, 0.2))
FOR_SHAPES(test_joined, build_joined(c))
FOR_SHAPES(test_conv_strided, ggn_graph_conv_strided(&graph, 0, 7, 3, 2))
FOR_SHAPES(test_batch_norm, ggn_graph_bn(&graph, 0))
FOR_SHAPES(test_lrelu, ggn_graph_lrelu(&graph, 0, 0.2))
FOR_SHAPES(test_sigmoid, ggn_graph_sigmoid(&graph, 0))
FOR_SHAPES(test_pool3, ggn_graph_maxpool(&graph, 0, 3))
FOR_SHAPES(test_up, ggn_graph_up(&graph, 0, c & 1, c > 2))
FOR_SHAPES(test_linear, ggn_graph_dropout(&graph, ggn_graph_linear(&graph, ggn_graph_flatten(&graph, 0), -1, 5), 0.5))

/* Linear layers that read a second vector, which another layer made, so that its gradient is added up. */
static void build_told(void)
{
    int x = ggn_graph_flatten(&graph, 0);
    int told = ggn_graph_linear(&graph, x, -1, 3);
    x = ggn_graph_linear(&graph, x, told, 6);
    ggn_graph_linear(&graph, x, told, 2);
}

FOR_SHAPES(test_told, build_told())

static void test_pool2(void **state)
{
    static const int size[4][3] = {{1, 2, 2}, {2, 5, 3}, {3, 9, 8}, {1, 3, 41}};
    for (int s = 0; s < 4; s++) {
        ggn_graph_begin(&graph, "pool2", size[s][0], size[s][1], size[s][2]);
        ggn_graph_maxpool(&graph, 0, 2);
        check("pool2", 1 + s % 2, (uint32_t)s + 40);
    }
    (void)state;
}

/* d/dh L(θ + h·d) at 0 against g·d for random directions d of all parameters and inputs. */
static void check_network(int net, enum ggn_preset preset, int side, int images)
{
    struct ggn_hyper hyper = {preset, side, side + 5, 2, 2, 3, 4, 0, 0, 0};
    struct base_err err = {0};

    if (ggn_network_build(&graph, net, &hyper, &err))
        fail_msg("%s", err.text);
    start(images, 9);
    for (uint32_t trial = 0; trial < 3; trial++) {
        double *theta = malloc(graph.n_params * sizeof *theta), slope = 0, value[2];
        assert_non_null(theta);
        memcpy(theta, weights->params, graph.n_params * sizeof *theta);
        loss(1, 3);
        for (size_t k = 0; k < graph.n_params; k++)
            slope += params_grad[k] * rnd((uint32_t)k, 1000 + trial);
        for (int side_of = 0; side_of < 2; side_of++) {
            for (size_t k = 0; k < graph.n_params; k++)
                weights->params[k] = theta[k] + (side_of ? -1 : 1) * 1e-7 * rnd((uint32_t)k, 1000 + trial);
            value[side_of] = loss(0, 3);
        }
        memcpy(weights->params, theta, graph.n_params * sizeof *theta);
        free(theta);
        double numeric = (value[0] - value[1]) / 2e-7;
        if (!(fabs(numeric - slope) <= 1e-4 * fmax(fabs(numeric), 1)))
            fail_msg("%s, direction %u: gradient %.10g, differences give %.10g", graph.name, trial, slope, numeric);
    }
    finish();
}

static void test_networks(void **state)
{
    for (int net = 0; net < GGN_NETS; net++) {
        check_network(net, GGN_PRESET_LULL, 32, 3);
        check_network(net, GGN_PRESET_PAPER, 19, 2);
    }
    (void)state;
}

static void test_ssim(void **state)
{
    enum { H = 14, W = 23, ROW = 26 };
    static double x[2][H * ROW], y[2][H * ROW], dx[2][H * ROW];
    const double *px[2] = {x[0], x[1]}, *py[2] = {y[0], y[1]};
    double *pd[2] = {dx[0], dx[1]};
    struct ggn_ssim *s = ggn_ssim_create(H, W, NULL, NULL);

    assert_non_null(s);
    for (int c = 0; c < 2; c++)
        for (int i = 0; i < H * ROW; i++) {
            x[c][i] = ggn_hash_unit((uint32_t)i, (uint32_t)c + 1);
            y[c][i] = 0.5 * x[c][i] + 0.5 * ggn_hash_unit((uint32_t)i, (uint32_t)c + 3);
        }
    ggn_ssim_mean(s, px, py, pd, 2, ROW, 1);
    for (int i = 0; i < 80; i++) {
        uint32_t k = ggn_hash((uint32_t)i, 7);
        double *p = &x[k & 1][(k >> 1) % H * ROW + (k >> 8) % W], grad = dx[k & 1][(k >> 1) % H * ROW + (k >> 8) % W],
               old = *p;
        *p = old + 1e-6;
        double high = ggn_ssim_mean(s, px, py, NULL, 2, ROW, 1);
        *p = old - 1e-6;
        double low = ggn_ssim_mean(s, px, py, NULL, 2, ROW, 1);
        *p = old;
        assert_true(fabs((high - low) / 2e-6 - grad) < 1e-8);
    }
    ggn_ssim_destroy(s);
    (void)state;
}

static void test_bce(void **state)
{
    for (int i = -50; i <= 50; i++)
        for (int j = 0; j <= 4; j++) {
            double z = 0.3 * i, y = j / 4.0;
            double numeric = (ggn_bce(z + 1e-6, y) - ggn_bce(z - 1e-6, y)) / 2e-6;
            assert_true(fabs(numeric - ggn_bce_grad(z, y)) < 1e-8);
        }
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conv3),  cmocka_unit_test(test_conv1),        cmocka_unit_test(test_conv_transposed),
        cmocka_unit_test(test_joined), cmocka_unit_test(test_conv_strided), cmocka_unit_test(test_batch_norm),
        cmocka_unit_test(test_lrelu),  cmocka_unit_test(test_sigmoid),      cmocka_unit_test(test_pool2),
        cmocka_unit_test(test_pool3),  cmocka_unit_test(test_up),           cmocka_unit_test(test_linear),
        cmocka_unit_test(test_told),   cmocka_unit_test(test_networks),     cmocka_unit_test(test_ssim),
        cmocka_unit_test(test_bce)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
