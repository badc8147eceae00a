/* The fast kernels of every instruction set against the naive oracle and against each other; same bytes for any number of
 * threads and any batch. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model/networks.h"
#include "nn/bf16.h"
#include "nn/exec.h"
#include "base/half.h"
#include "support/ggn_naive.h"

static const double F32_TOLERANCE = 2e-5, F64_TOLERANCE = 1e-12; /* of sums of up to some thousand products of order 1 */

static double rnd(uint32_t k, uint32_t s)
{
    return 2 * ggn_hash_unit(k, s) - 1;
}

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

static struct oracle make_oracle(uint32_t seed)
{
    struct oracle o = {.slope = ggn_hash(1, seed) % 2 ? 0.25 : 1};
    o.c = (struct ggn_naive_conv){.c_in = 1 + (int)(ggn_hash(2, seed) % 40),
                                  .c_out = 1 + (int)(ggn_hash(3, seed) % 24),
                                  .h = 1 + (int)(ggn_hash(4, seed) % 15),
                                  .w = 1 + (int)(ggn_hash(5, seed) % 70),
                                  .kernel = ggn_hash(6, seed) % 4 ? 3 : 1,
                                  .transposed = (int)(ggn_hash(7, seed) % 2)};
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

static void free_oracle(struct oracle *o)
{
    double *all[] = {o->x, o->weight, o->bias, o->y, o->dz, o->dx, o->dweight, o->dbias};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        free(all[i]);
}

static void near(const char *what, enum ggn_isa isa, uint32_t seed, double got, double want, double scale, double tolerance)
{
    if (!(fabs(got - want) <= tolerance * fmax(fabs(want), scale)))
        fail_msg("%s on %s, seed %u: %.9g, expected %.9g", what, ggn_isa_name(isa), seed, got, want);
}

/* One convolution through an executor whose kernels are those of `isa`. */
#define DEFINE_CHECK(REAL, suffix, tolerance)                                                                               \
    static void check_##suffix(const struct oracle *o, enum ggn_isa isa, uint32_t seed)                                     \
    {                                                                                                                       \
        static struct ggn_graph g;                                                                                          \
        const struct ggn_kernels_##suffix *k = ggn_kernels_for_##suffix(isa);                                               \
        ggn_graph_begin(&g, "conv", o->c.c_in, o->c.h, o->c.w);                                                             \
        ggn_graph_stage(&g, "a");                                                                                           \
        ggn_graph_conv(&g, 0, -1, o->c.c_out, o->c.kernel, o->c.transposed, o->slope);                                      \
        assert_int_equal(ggn_graph_end(&g, NULL), 0);                                                                  \
        struct ggn_weights_##suffix *w = ggn_weights_create_##suffix(&g, k, 1, NULL);                                       \
        struct ggn_exec_##suffix *e = ggn_exec_create_##suffix(&g, k, 1, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD, NULL, NULL); \
        REAL *grad = calloc(g.n_params, sizeof *grad);                                                                      \
        const int area = o->c.h * o->c.w, row = o->c.w + 1, n_w = (int)g.tensor[0].count;                                   \
        assert_true(w &&e &&grad);                                                                                          \
        for (int i = 0; i < n_w; i++)                                                                                       \
            w->params[i] = (REAL)o->weight[i];                                                                              \
        for (int i = 0; i < o->c.c_out; i++)                                                                                \
            w->params[n_w + i] = (REAL)o->bias[i];                                                                          \
        ggn_weights_pack_##suffix(w);                                                                                       \
        for (int i = 0; i < o->c.c_in * area; i++)                                                                          \
            ggn_exec_plane_##suffix(e, 0, 0, i / area)[i % area / o->c.w * row + i % area % o->c.w] = (REAL)o->x[i];        \
        ggn_exec_forward_##suffix(e, w, 1, GGN_TRAIN);                                                                      \
        for (int i = 0; i < o->c.c_out * area; i++) {                                                                       \
            int at = i % area / o->c.w * row + i % area % o->c.w;                                                           \
            near("forward", isa, seed, (double)ggn_exec_plane_##suffix(e, 1, 0, i / area)[at], o->y[i], o->c.c_in,          \
                 tolerance);                                                                                                \
            double dy = o->y[i] > 0 ? o->dz[i] : o->dz[i] / o->slope;                                                       \
            ggn_exec_grad_##suffix(e, 1, 0, i / area)[at] = (REAL)dy;                                                       \
        }                                                                                                                   \
        ggn_exec_backward_##suffix(e, w, grad);                                                                             \
        for (int i = 0; i < o->c.c_in * area; i++)                                                                          \
            near("input gradient", isa, seed,                                                                               \
                 (double)ggn_exec_grad_##suffix(e, 0, 0, i / area)[i % area / o->c.w * row + i % area % o->c.w], o->dx[i],  \
                 o->c.c_out, tolerance);                                                                                    \
        for (int i = 0; i < n_w; i++)                                                                                       \
            near("weight gradient", isa, seed, (double)grad[i], o->dweight[i], area, tolerance);                            \
        for (int i = 0; i < o->c.c_out; i++)                                                                                \
            near("bias gradient", isa, seed, (double)grad[n_w + i], o->dbias[i], area, tolerance);                          \
        ggn_weights_destroy_##suffix(w);                                                                                    \
        ggn_exec_destroy_##suffix(e);                                                                                       \
        free(grad);                                                                                                         \
    }
DEFINE_CHECK(float, f32, F32_TOLERANCE)
DEFINE_CHECK(double, f64, F64_TOLERANCE)

static void test_convolutions(void **state)
{
    for (uint32_t seed = 10; seed < 28; seed++) {
        struct oracle o = make_oracle(seed);
        for (int isa = 0; isa < GGN_ISA_COUNT; isa++)
            if (ggn_isa_available((enum ggn_isa)isa)) {
                check_f32(&o, (enum ggn_isa)isa, seed);
                check_f64(&o, (enum ggn_isa)isa, seed);
            }
        free_oracle(&o);
    }
    (void)state;
}

/* bfloat16 products: the oracle on weights and pixels that were rounded beforehand. */
static void check_bf16(struct oracle *o, uint32_t seed)
{
    static struct ggn_graph g;
    const int area = o->c.h * o->c.w, row = o->c.w + 1, n_x = o->c.c_in * area;

    ggn_graph_begin(&g, "conv", o->c.c_in, o->c.h, o->c.w);
    ggn_graph_stage(&g, "a");
    ggn_graph_conv(&g, 0, -1, o->c.c_out, 3, o->c.transposed, o->slope);
    assert_int_equal(ggn_graph_end(&g, NULL), 0);
    struct ggn_weights_f32 *w = ggn_weights_create_f32(&g, NULL, GGN_WEIGHTS_BF16, NULL);
    struct ggn_exec_f32 *e = ggn_exec_create_f32(&g, NULL, 1, GGN_EXEC_BF16, NULL, NULL);
    const int n_w = (int)g.tensor[0].count;
    assert_true(w && e);
    for (int i = 0; i < n_w; i++) {
        w->params[i] = (float)o->weight[i];
        o->weight[i] = (double)base_bf16_to_f32(base_f32_to_bf16((float)o->weight[i]));
    }
    for (int i = 0; i < o->c.c_out; i++)
        w->params[n_w + i] = (float)o->bias[i];
    ggn_weights_pack_f32(w);
    for (int i = 0; i < n_x; i++) {
        ggn_exec_plane_f32(e, 0, 0, i / area)[i % area / o->c.w * row + i % area % o->c.w] = (float)o->x[i];
        o->x[i] = (double)base_bf16_to_f32(base_f32_to_bf16((float)o->x[i]));
    }
    ggn_naive_forward(&o->c, o->x, o->weight, o->bias, o->slope, o->y);
    ggn_exec_forward_f32(e, w, 1, GGN_EVAL);
    for (int i = 0; i < o->c.c_out * area; i++)
        near("bfloat16 forward", GGN_ISA_AVX512, seed,
             (double)ggn_exec_plane_f32(e, 1, 0, i / area)[i % area / o->c.w * row + i % area % o->c.w], o->y[i], o->c.c_in,
             F32_TOLERANCE);
    ggn_weights_destroy_f32(w);
    ggn_exec_destroy_f32(e);
}

static void test_bf16(void **state)
{
    if (!ggn_bf16_available())
        skip();
    for (uint32_t seed = 10; seed < 28; seed++) {
        struct oracle o = make_oracle(seed);
        if (o.c.kernel == 3)
            check_bf16(&o, seed);
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
    for (int isa = 0; isa < GGN_ISA_COUNT; isa++) {
        const struct ggn_kernels_f32 *k = ggn_kernels_for_f32((enum ggn_isa)isa);
        if (!k)
            continue;
        struct ggn_weights_f32 *w = ggn_weights_create_f32(&g, k, 0, NULL);
        struct ggn_exec_f32 *e = ggn_exec_create_f32(&g, k, 1, 0, NULL, NULL);
        assert_true(w && e);
        ggn_weights_init_f32(w, GGN_INIT_HASH, 8);
        ggn_weights_pack_f32(w);
        for (int pass = 0; pass < 2; pass++) {
            for (int i = 0; i < C * H * W; i++)
                ggn_exec_plane_f32(e, 0, 0, i / (H * W))[i / W % H * ROW + i % W] =
                    i % W < 2 ? (pass ? 1e20f : 0) : (float)rnd((uint32_t)i, 6);
            ggn_exec_forward_f32(e, w, 1, GGN_EVAL);
            for (int c = 0; c < C; c++)
                for (int y = 0; y < H; y++) {
                    const float *row = ggn_exec_plane_f32(e, 1, 0, c) + y * ROW;
                    if (pass)
                        assert_memory_equal(row + 4, kept[c][y] + 4, (W - 4) * sizeof *row);
                    else
                        memcpy(kept[c][y], row, sizeof kept[c][y]);
                }
        }
        ggn_weights_destroy_f32(w);
        ggn_exec_destroy_f32(e);
    }
    (void)state;
}

/* Output and parameter gradient of a whole small network, as doubles. */
struct result {
    double *y, *grad;
    size_t n_y, n_grad;
};

#define DEFINE_RUN(REAL, suffix)                                                                                            \
    static struct result run_##suffix(const struct ggn_graph *g, enum ggn_isa isa, int batch, struct base_threads *threads)  \
    {                                                                                                                       \
        const struct ggn_kernels_##suffix *k = ggn_kernels_for_##suffix(isa);                                               \
        struct ggn_weights_##suffix *w = ggn_weights_create_##suffix(g, k, 1, NULL);                                        \
        struct ggn_exec_##suffix *e = ggn_exec_create_##suffix(g, k, batch, GGN_EXEC_GRADS, threads, NULL);                 \
        const struct ggn_value *in = &g->value[0], *out = &g->value[g->n_values - 1];                                       \
        const int area = out->h * out->w;                                                                                   \
        struct result r = {.n_y = (size_t)(batch * out->c * area), .n_grad = g->n_params};                                  \
        REAL *grad = calloc(g->n_params, sizeof *grad);                                                                     \
        r.y = calloc(r.n_y, sizeof *r.y);                                                                                   \
        r.grad = calloc(r.n_grad, sizeof *r.grad);                                                                          \
        assert_true(w &&e &&grad &&r.y &&r.grad);                                                                           \
        ggn_weights_init_##suffix(w, GGN_INIT_HASH, 12);                                                                    \
        ggn_weights_pack_##suffix(w);                                                                                       \
        for (int i = 0; i < batch * in->c * in->h * in->w; i++) {                                                           \
            int p = i % (in->h * in->w), c = i / (in->h * in->w);                                                           \
            ggn_exec_plane_##suffix(e, 0, c / in->c, c % in->c)[(long)(p / in->w) * in->row + p % in->w] =                  \
                (REAL)ggn_hash_unit((uint32_t)i, 3);                                                                        \
        }                                                                                                                   \
        ggn_exec_forward_##suffix(e, w, batch, GGN_TRAIN);                                                                  \
        for (int i = 0; i < (int)r.n_y; i++) {                                                                              \
            long at = (long)(i % area / out->w) * out->row + i % area % out->w;                                             \
            r.y[i] = (double)ggn_exec_plane_##suffix(e, g->n_values - 1, i / area / out->c, i / area % out->c)[at];         \
            ggn_exec_grad_##suffix(e, g->n_values - 1, i / area / out->c, i / area % out->c)[at] =                          \
                (REAL)rnd((uint32_t)i, 5);                                                                                  \
        }                                                                                                                   \
        ggn_exec_backward_##suffix(e, w, grad);                                                                             \
        for (size_t i = 0; i < r.n_grad; i++)                                                                               \
            r.grad[i] = (double)grad[i];                                                                                    \
        ggn_weights_destroy_##suffix(w);                                                                                    \
        ggn_exec_destroy_##suffix(e);                                                                                       \
        free(grad);                                                                                                         \
        return r;                                                                                                           \
    }
DEFINE_RUN(float, f32)
DEFINE_RUN(double, f64)

static void free_result(struct result *r)
{
    free(r->y);
    free(r->grad);
}

static void build(struct ggn_graph *g, int net)
{
    struct ggn_hyper hyper = {GGN_PRESET_LULL, 40, 51, 2, 3, 5, 4};
    assert_int_equal(ggn_network_build(g, net, &hyper, NULL), 0);
}

static double norm(const double *x, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum / (double)n);
}

static void agree(const struct result *a, const struct result *b, double tolerance, const char *what)
{
    for (size_t i = 0; i < a->n_y; i++)
        if (!(fabs(a->y[i] - b->y[i]) <= tolerance * fmax(1, norm(b->y, b->n_y))))
            fail_msg("%s: output %zu is %.9g, base double gives %.9g", what, i, a->y[i], b->y[i]);
    double scale = norm(b->grad, b->n_grad);
    for (size_t i = 0; i < a->n_grad; i++)
        if (!(fabs(a->grad[i] - b->grad[i]) <= 30 * tolerance * fmax(scale, fabs(b->grad[i]))))
            fail_msg("%s: gradient %zu is %.9g, base double gives %.9g", what, i, a->grad[i], b->grad[i]);
}

static void test_instruction_sets(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        build(&g, net);
        struct result want = run_f64(&g, GGN_ISA_BASE, 3, NULL);
        for (int isa = 0; isa < GGN_ISA_COUNT; isa++)
            if (ggn_isa_available((enum ggn_isa)isa)) {
                struct result d = run_f64(&g, (enum ggn_isa)isa, 3, NULL), f = run_f32(&g, (enum ggn_isa)isa, 3, NULL);
                agree(&d, &want, 1e-10, ggn_isa_name((enum ggn_isa)isa));
                agree(&f, &want, 1e-4, ggn_isa_name((enum ggn_isa)isa));
                free_result(&d);
                free_result(&f);
            }
        free_result(&want);
    }
    (void)state;
}

static void test_threads_same_bytes(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        build(&g, net);
        struct result want = run_f32(&g, ggn_isa_best(), 3, NULL);
        for (int count = 1; count <= 3; count++) {
            struct base_threads *threads = base_threads_create(count, NULL);
            struct result got = run_f32(&g, ggn_isa_best(), 3, threads);
            assert_memory_equal(got.y, want.y, want.n_y * sizeof *want.y);
            assert_memory_equal(got.grad, want.grad, want.n_grad * sizeof *want.grad);
            free_result(&got);
            base_threads_destroy(threads);
        }
        free_result(&want);
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
        struct ggn_weights_f32 *w = ggn_weights_create_f32(&g, NULL, 0, NULL);
        struct ggn_exec_f32 *many = ggn_exec_create_f32(&g, NULL, BATCH, 0, NULL, NULL);
        struct ggn_exec_f32 *one = ggn_exec_create_f32(&g, NULL, 1, 0, NULL, NULL);
        const struct ggn_value *in = &g.value[0], *out = &g.value[g.n_values - 1];
        assert_true(w && many && one);
        ggn_weights_init_f32(w, GGN_INIT_HASH, 4);
        ggn_weights_pack_f32(w);
        for (int n = 0; n < BATCH; n++)
            for (int c = 0; c < in->c; c++)
                for (int k = 0; k < in->h * in->w; k++)
                    ggn_exec_plane_f32(many, 0, n, c)[(long)(k / in->w) * in->row + k % in->w] =
                        (float)ggn_hash_unit((uint32_t)k, (uint32_t)(n * in->c + c));
        ggn_exec_forward_f32(many, w, BATCH, GGN_EVAL);
        for (int n = 0; n < BATCH; n++) {
            for (int c = 0; c < in->c; c++)
                for (int y = 0; y < in->h; y++)
                    memcpy(ggn_exec_plane_f32(one, 0, 0, c) + (long)y * in->row,
                           ggn_exec_plane_f32(many, 0, n, c) + (long)y * in->row, (size_t)in->w * sizeof(float));
            ggn_exec_forward_f32(one, w, 1, GGN_EVAL);
            for (int c = 0; c < out->c; c++)
                for (int y = 0; y < out->h; y++)
                    assert_memory_equal(ggn_exec_plane_f32(one, g.n_values - 1, 0, c) + (long)y * out->row,
                                        ggn_exec_plane_f32(many, g.n_values - 1, n, c) + (long)y * out->row,
                                        (size_t)out->w * sizeof(float));
        }
        ggn_weights_destroy_f32(w);
        ggn_exec_destroy_f32(many);
        ggn_exec_destroy_f32(one);
    }
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_convolutions),       cmocka_unit_test(test_bf16),
                                       cmocka_unit_test(test_row_ends),           cmocka_unit_test(test_instruction_sets),
                                       cmocka_unit_test(test_threads_same_bytes), cmocka_unit_test(test_batch_same_bytes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
