/* Convolutions of every instruction set against the naive oracle and against each other; same bytes for any number of
 * threads and any batch. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model/networks.h"
#include "nn/exec.h"
#include "nn/hash.h"
#include "base/bytes.h"
#include "support/ggn_naive.h"
#include "support/ggn_network_run.h"
#include "support/ggn_nn_near.h"

/* Oracle values of one random convolution. */
struct oracle {
    struct ggn_naive_conv c;
    double slope, *x, *weight, *bias, *y, *dz, *dx, *dweight, *dbias;
};

static double *filled(size_t n, uint32_t seed)
{
    double *a = calloc(n, sizeof *a);
    assert_non_null(a);
    for (size_t i = 0; i < n && seed; i++)
        a[i] = (double)(float)rnd((uint32_t)i, seed);
    return a;
}

static struct oracle oracle_of(struct ggn_naive_conv c, double slope, uint32_t seed)
{
    struct oracle o = {.c = c, .slope = slope};
    size_t area = (size_t)(o.c.h * o.c.w), n_in = (size_t)o.c.c_in, n_out = (size_t)o.c.c_out;
    size_t n_w = n_in * n_out * (size_t)(o.c.kernel * o.c.kernel);
    o.x = filled(n_in * area, seed + 1);
    o.weight = filled(n_w, seed + 2);
    o.bias = filled(n_out, seed + 3);
    o.y = filled(n_out * area, 0);
    o.dz = filled(n_out * area, seed + 4);
    o.dx = filled(n_in * area, 0);
    o.dweight = filled(n_w, 0);
    o.dbias = filled(n_out, 0);
    ggn_naive_forward(&o.c, o.x, o.weight, o.bias, o.slope, o.y);
    for (size_t i = 0; i < n_out * area; i++) /* the executor is given the gradient after the activation */
        o.dz[i] = o.y[i] > 0 ? o.dz[i] : o.slope * o.dz[i];
    ggn_naive_backward(&o.c, o.x, o.weight, o.dz, o.dx, o.dweight, o.dbias);
    return o;
}

static struct oracle make_oracle(uint32_t seed)
{
    const struct ggn_naive_conv c = {.c_in = 1 + (int)(ggn_hash(2, seed) % 40),
                                     .c_out = 1 + (int)(ggn_hash(3, seed) % 24),
                                     .h = 1 + (int)(ggn_hash(4, seed) % 15),
                                     .w = 1 + (int)(ggn_hash(5, seed) % 70),
                                     .kernel = ggn_hash(6, seed) % 4 ? 3 : 1,
                                     .transposed = (int)(ggn_hash(7, seed) % 2)};
    return oracle_of(c, ggn_hash(1, seed) % 2 ? 0.25 : 1, seed);
}

static void free_oracle(struct oracle *o)
{
    double *all[] = {o->x, o->weight, o->bias, o->y, o->dz, o->dx, o->dweight, o->dbias};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        free(all[i]);
}

typedef struct ggn_network_pass run_fn(const struct ggn_graph *, enum base_isa, int, struct base_threads *, const double *,
                                       const double *, const double *);

static void free_pass(struct ggn_network_pass *r)
{
    free(r->y);
    free(r->dx);
    free(r->grad);
}

/* One convolution, as a network of one layer. */
static void check(run_fn *run, const struct oracle *o, enum base_isa isa, uint32_t seed, double tolerance)
{
    static struct ggn_graph g;
    const int area = o->c.h * o->c.w;

    ggn_graph_begin(&g, "conv", o->c.c_in, o->c.h, o->c.w);
    ggn_graph_stage(&g, "a");
    ggn_graph_conv(&g, 0, -1, o->c.c_out, o->c.kernel, o->c.transposed, o->slope);
    assert_int_equal(ggn_graph_end(&g, NULL), 0);
    const size_t n_w = g.tensor[0].count;
    double *params = filled(g.n_params, 0), *dy = filled((size_t)(o->c.c_out * area), 0);
    memcpy(params, o->weight, n_w * sizeof *params);
    memcpy(params + n_w, o->bias, (size_t)o->c.c_out * sizeof *params);
    for (int i = 0; i < o->c.c_out * area; i++)
        dy[i] = o->y[i] > 0 ? o->dz[i] : o->dz[i] / o->slope;
    struct ggn_network_pass r = run(&g, isa, 1, NULL, params, o->x, dy);
    for (size_t i = 0; i < r.n_y; i++)
        near("forward", isa, seed, r.y[i], o->y[i], o->c.c_in, tolerance);
    for (size_t i = 0; i < r.n_dx; i++)
        near("input gradient", isa, seed, r.dx[i], o->dx[i], o->c.c_out, tolerance);
    for (size_t i = 0; i < r.n_grad; i++)
        near("parameter gradient", isa, seed, r.grad[i], i < n_w ? o->dweight[i] : o->dbias[i - n_w], area, tolerance);
    free_pass(&r);
    free(params);
    free(dy);
}

static void test_convolutions(void **state)
{
    for (uint32_t seed = 10; seed < 28; seed++) {
        struct oracle o = make_oracle(seed);
        for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
            if (base_isa_available((enum base_isa)isa)) {
                check(ggn_network_run, &o, (enum base_isa)isa, seed, F32_TOLERANCE);
                check(ggn_network_run_f64, &o, (enum base_isa)isa, seed, F64_TOLERANCE);
            }
        free_oracle(&o);
    }
    (void)state;
}

/* More channels, columns and rows than one task, register tile or block of tiles has. */
static void test_large_convolutions(void **state)
{
    static const struct ggn_naive_conv sizes[] = {{.c_in = 35, .c_out = 45, .h = 9, .w = 145, .kernel = 3},
                                                  {.c_in = 20, .c_out = 35, .h = 41, .w = 30, .kernel = 3, .transposed = 1}};
    for (uint32_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        struct oracle o = oracle_of(sizes[k], 0.25, 60 + k);
        for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
            if (base_isa_available((enum base_isa)isa))
                check(ggn_network_run, &o, (enum base_isa)isa, 60 + k, F32_TOLERANCE);
        free_oracle(&o);
    }
    (void)state;
}

/* What lies beyond the right border in memory is the next row's left end: it must not touch the outputs there, not even by
 * its rounding. Same bytes with and without enormous values in the two leftmost columns. */
static void test_row_ends(void **state)
{
    enum { C = 16, H = 21, W = 50, ROW = W + 1 };
    static struct ggn_graph g;
    static float kept[C][H][W];

    ggn_graph_begin(&g, "rows", C, H, W);
    ggn_graph_stage(&g, "a");
    ggn_graph_conv(&g, 0, -1, C, 3, 0, 1);
    assert_int_equal(ggn_graph_end(&g, NULL), 0);
    for (int isa = 0; isa < BASE_ISA_COUNT; isa++) {
        const struct ggn_kernels *k = ggn_kernels_for((enum base_isa)isa);
        if (!k)
            continue;
        struct ggn_weights *w = ggn_weights_create(&g, k, 0, NULL);
        struct ggn_exec *e = ggn_exec_create(&g, k, 1, 0, NULL, NULL);
        assert_true(w && e);
        ggn_weights_init(w, GGN_INIT_HASH, 8);
        ggn_weights_pack(w, NULL);
        for (int pass = 0; pass < 2; pass++) {
            for (int i = 0; i < C * H * W; i++)
                ggn_exec_plane(e, 0, 0, i / (H * W))[i / W % H * ROW + i % W] =
                    i % W < 2 ? (pass ? 1e20f : 0) : (float)rnd((uint32_t)i, 6);
            ggn_exec_forward(e, w, 1, GGN_EVAL);
            for (int c = 0; c < C; c++)
                for (int y = 0; y < H; y++) {
                    const float *row = ggn_exec_plane(e, 1, 0, c) + y * ROW;
                    if (pass)
                        assert_memory_equal(row + 4, kept[c][y] + 4, (W - 4) * sizeof *row);
                    else
                        memcpy(kept[c][y], row, sizeof kept[c][y]);
                }
        }
        ggn_weights_destroy(w);
        ggn_exec_destroy(e);
    }
    (void)state;
}

/* A whole small network on hashed inputs and gradients. */
static struct ggn_network_pass pass_of(run_fn *run, const struct ggn_graph *g, enum base_isa isa, int batch,
                                       struct base_threads *threads)
{
    const struct ggn_value *in = &g->value[0], *out = &g->value[g->n_values - 1];
    const int n_x = batch * in->c * in->h * in->w, n_y = batch * out->c * out->h * out->w;
    double *x = filled((size_t)n_x, 0), *dy = filled((size_t)n_y, 0);

    for (int i = 0; i < n_x; i++)
        x[i] = ggn_hash_unit((uint32_t)i, 3);
    for (int i = 0; i < n_y; i++)
        dy[i] = rnd((uint32_t)i, 5);
    struct ggn_network_pass r = run(g, isa, batch, threads, NULL, x, dy);
    free(x);
    free(dy);
    return r;
}

static void build(struct ggn_graph *g, int net)
{
    struct ggn_hyper hyper = {GGN_PRESET_LULL, 40, 51, 2, 3, 5, 4, 0, 0, 0};
    assert_int_equal(ggn_network_build(g, net, &hyper, NULL), 0);
}

static double norm(const double *x, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / (double)n);
}

static void agree(const struct ggn_network_pass *a, const struct ggn_network_pass *b, double tolerance, const char *what)
{
    const double largest = fmax(1, norm(b->y, b->n_y)), scale = norm(b->grad, b->n_grad);

    for (size_t i = 0; i < a->n_y; i++)
        if (!(fabs(a->y[i] - b->y[i]) <= tolerance * largest))
            fail_msg("%s: output %zu is %.9g, base double gives %.9g", what, i, a->y[i], b->y[i]);
    for (size_t i = 0; i < a->n_grad; i++)
        if (!(fabs(a->grad[i] - b->grad[i]) <= 30 * tolerance * fmax(scale, fabs(b->grad[i]))))
            fail_msg("%s: gradient %zu is %.9g, base double gives %.9g", what, i, a->grad[i], b->grad[i]);
}

static void test_instruction_sets(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        build(&g, net);
        struct ggn_network_pass want = pass_of(ggn_network_run_f64, &g, BASE_ISA_BASE, 3, NULL);
        for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
            if (base_isa_available((enum base_isa)isa)) {
                struct ggn_network_pass d = pass_of(ggn_network_run_f64, &g, (enum base_isa)isa, 3, NULL),
                                        f = pass_of(ggn_network_run, &g, (enum base_isa)isa, 3, NULL);
                agree(&d, &want, 1e-10, base_isa_name((enum base_isa)isa));
                agree(&f, &want, 1e-4, base_isa_name((enum base_isa)isa));
                free_pass(&d);
                free_pass(&f);
            }
        free_pass(&want);
    }
    (void)state;
}

static void test_threads_same_bytes(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        build(&g, net);
        struct ggn_network_pass want = pass_of(ggn_network_run, &g, base_isa_best(), 3, NULL);
        for (int count = 1; count <= 3; count++) {
            struct base_threads *threads = base_threads_create(count, NULL);
            struct ggn_network_pass got = pass_of(ggn_network_run, &g, base_isa_best(), 3, threads);
            assert_memory_equal(got.y, want.y, want.n_y * sizeof *want.y);
            assert_memory_equal(got.grad, want.grad, want.n_grad * sizeof *want.grad);
            free_pass(&got);
            base_threads_destroy(threads);
        }
        free_pass(&want);
    }
    (void)state;
}

/* Evaluation: each image's bytes do not depend on the batch, nor on reused memory or fused layers. */
static void test_batch_same_bytes(void **state)
{
    enum { BATCH = 16 };
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        build(&g, net);
        struct ggn_weights *w = ggn_weights_create(&g, NULL, 0, NULL);
        struct ggn_exec *many = ggn_exec_create(&g, NULL, BATCH, 0, NULL, NULL);
        struct ggn_exec *one = ggn_exec_create(&g, NULL, 1, 0, NULL, NULL);
        const struct ggn_value *in = &g.value[0], *out = &g.value[g.n_values - 1];
        assert_true(w && many && one);
        ggn_weights_init(w, GGN_INIT_HASH, 4);
        ggn_weights_pack(w, NULL);
        for (int n = 0; n < BATCH; n++)
            for (int c = 0; c < in->c; c++)
                for (int k = 0; k < in->h * in->w; k++)
                    ggn_exec_plane(many, 0, n, c)[(long)(k / in->w) * in->row + k % in->w] =
                        (float)ggn_hash_unit((uint32_t)k, (uint32_t)(n * in->c + c));
        ggn_exec_forward(many, w, BATCH, GGN_EVAL);
        for (int n = 0; n < BATCH; n++) {
            for (int c = 0; c < in->c; c++)
                for (int y = 0; y < in->h; y++)
                    memcpy(ggn_exec_plane(one, 0, 0, c) + (long)y * in->row,
                           ggn_exec_plane(many, 0, n, c) + (long)y * in->row, (size_t)in->w * sizeof(float));
            ggn_exec_forward(one, w, 1, GGN_EVAL);
            for (int c = 0; c < out->c; c++)
                for (int y = 0; y < out->h; y++)
                    assert_memory_equal(ggn_exec_plane(one, g.n_values - 1, 0, c) + (long)y * out->row,
                                        ggn_exec_plane(many, g.n_values - 1, n, c) + (long)y * out->row,
                                        (size_t)out->w * sizeof(float));
        }
        ggn_weights_destroy(w);
        ggn_exec_destroy(many);
        ggn_exec_destroy(one);
    }
    (void)state;
}

enum { SENTINEL = 77 };

/* Without GGN_EXEC_INPUT_GRAD the planes of the input's gradient are the caller's: the trainer keeps references there. */
static void test_input_gradient_is_left_alone(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++)
        for (int wanted_too = 0; wanted_too < 2; wanted_too++) {
            build(&g, net);
            struct ggn_weights *w = ggn_weights_create(&g, NULL, GGN_WEIGHTS_BACKWARD, NULL);
            struct ggn_exec *e =
                ggn_exec_create(&g, NULL, 1, GGN_EXEC_GRADS | (wanted_too ? GGN_EXEC_INPUT_GRAD : 0), NULL, NULL);
            float *grad = calloc(g.n_params, sizeof *grad);
            const struct ggn_value *in = &g.value[0], *out = &g.value[g.n_values - 1];
            assert_true(w && e && grad);
            ggn_weights_init(w, GGN_INIT_HASH, 4);
            ggn_weights_pack(w, NULL);
            for (int k = 0; k < in->c * in->h * in->w; k++)
                ggn_exec_grad(e, 0, 0, k / (in->h * in->w))[k / in->w % in->h * in->row + k % in->w] = SENTINEL;
            ggn_exec_forward(e, w, 1, GGN_TRAIN);
            for (int k = 0; k < out->c * out->h * out->w; k++)
                ggn_exec_grad(e, g.n_values - 1, 0, k / (out->h * out->w))[k / out->w % out->h * out->row + k % out->w] = 1;
            ggn_exec_backward(e, w, grad);
            for (int k = 0; k < in->c * in->h * in->w; k++)
                assert_int_equal(ggn_exec_grad(e, 0, 0, k / (in->h * in->w))[k / in->w % in->h * in->row + k % in->w] !=
                                     SENTINEL,
                                 wanted_too);
            ggn_weights_destroy(w);
            ggn_exec_destroy(e);
            free(grad);
        }
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_convolutions),
        cmocka_unit_test(test_large_convolutions),
        cmocka_unit_test(test_row_ends),
        cmocka_unit_test(test_instruction_sets),
        cmocka_unit_test(test_threads_same_bytes),
        cmocka_unit_test(test_batch_same_bytes),
        cmocka_unit_test(test_input_gradient_is_left_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
