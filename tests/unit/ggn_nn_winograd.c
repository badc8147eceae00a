/* Winograd's algorithm of every instruction set: against the naive oracle at sizes that leave tiles, vectors and register tiles
 * part empty, and the same bytes with 8 lanes as with 16, however the work is cut. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/exec.h"
#include "nn/hash.h"
#include "nn/winograd.h"
#include "support/ggn_naive.h"

enum { MOST = 40 }; /* channels */

static const double TOLERANCE = 2e-5; /* of sums of some hundred products of order 1 */

static const struct ggn_naive_conv sizes[] = {
    {.c_in = 3, .c_out = 11, .h = 9, .w = 9, .kernel = 3},    {.c_in = 8, .c_out = 4, .h = 12, .w = 12, .kernel = 3},
    {.c_in = 13, .c_out = 7, .h = 1, .w = 37, .kernel = 3},   {.c_in = 9, .c_out = 17, .h = 35, .w = 1, .kernel = 3},
    {.c_in = 32, .c_out = 33, .h = 6, .w = 131, .kernel = 3}, {.c_in = 25, .c_out = 40, .h = 29, .w = 31, .kernel = 3},
    {.c_in = 6, .c_out = 6, .h = 38, .w = 34, .kernel = 3},   {.c_in = 16, .c_out = 21, .h = 13, .w = 66, .kernel = 3}};
enum { N_SIZES = sizeof sizes / sizeof sizes[0] };

/* One convolution: its planes and weights, as the kernels want them and as the oracle does. */
struct work {
    struct ggn_naive_conv c;
    struct ggn_graph *graph;
    struct ggn_exec *e; /* plane 0 is the input, 1 the output or its gradient */
    const float *x[MOST];
    float *y[MOST];
    double *in, *weight, *bias, *out, *dz, *dw, *dx, *db;
};

static double *room(size_t n)
{
    double *p = calloc(n, sizeof *p);
    assert_non_null(p);
    return p;
}

static double value(size_t i, uint32_t seed) { return (double)(float)(2 * ggn_hash_unit((uint32_t)i, seed) - 1); }

static void put(const struct work *w, float *plane, const double *from)
{
    for (int i = 0; i < w->c.h * w->c.w; i++)
        plane[i / w->c.w * (w->c.w + 1) + i % w->c.w] = (float)from[i];
}

/* Everything filled with numbers; what the planes hold beyond the picture stays 0. */
static struct work begin(const struct ggn_naive_conv *c, uint32_t seed)
{
    struct work w = {.c = *c, .graph = calloc(1, sizeof *w.graph)};
    const size_t area = (size_t)(c->h * c->w), n_in = (size_t)c->c_in, n_out = (size_t)c->c_out;

    assert_non_null(w.graph);
    ggn_graph_begin(w.graph, "winograd", c->c_in, c->h, c->w);
    ggn_graph_stage(w.graph, "a");
    ggn_graph_conv(w.graph, 0, -1, c->c_out, 3, 0, 1);
    assert_int_equal(ggn_graph_end(w.graph, NULL), 0);
    w.e = ggn_exec_create(w.graph, NULL, 1, 0, NULL, NULL);
    assert_non_null(w.e);
    w.in = room(n_in * area);
    w.weight = room(9 * n_in * n_out);
    w.bias = room(n_out);
    w.out = room(n_out * area);
    w.dz = room(n_out * area);
    w.dw = room(9 * n_in * n_out);
    w.dx = room(n_in * area);
    w.db = room(n_out);
    for (size_t i = 0; i < n_in * area; i++)
        w.in[i] = value(i, seed);
    for (size_t i = 0; i < 9 * n_in * n_out; i++)
        w.weight[i] = value(i, seed + 1);
    for (size_t i = 0; i < n_out; i++)
        w.bias[i] = value(i, seed + 2);
    for (size_t i = 0; i < n_out * area; i++)
        w.dz[i] = value(i, seed + 3);
    ggn_naive_forward(&w.c, w.in, w.weight, w.bias, 0.25, w.out);
    ggn_naive_backward(&w.c, w.in, w.weight, w.dz, w.dx, w.dw, w.db);
    for (int i = 0; i < c->c_in; i++) {
        float *plane = ggn_exec_plane(w.e, 0, 0, i);
        put(&w, plane, w.in + (size_t)i * area);
        w.x[i] = plane;
    }
    for (int o = 0; o < c->c_out; o++)
        w.y[o] = ggn_exec_plane(w.e, 1, 0, o);
    return w;
}

static void end(struct work *w)
{
    double *const all[] = {w->in, w->weight, w->bias, w->out, w->dz, w->dw, w->dx, w->db};

    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        free(all[i]);
    ggn_exec_destroy(w->e);
    free(w->graph);
}

static void near(const char *what, enum base_isa isa, size_t at, double got, double want, double scale)
{
    if (!(fabs(got - want) <= TOLERANCE * fmax(fabs(want), scale)))
        fail_msg("%s on %s, element %zu: %.9g, not %.9g", what, base_isa_name(isa), at, got, want);
}

/* u as the kernels of `k` want it. */
static float *pack(const struct work *w, const struct ggn_kernels *k)
{
    const int n_in = w->c.c_in, n_out = w->c.c_out;
    float *packed = calloc((size_t)(9 * n_in * n_out), sizeof *packed), *to = packed;
    float *u = calloc((size_t)(36 * n_in * n_out), sizeof *u);

    assert_true(packed && u);
    for (int oc = 0, tile; oc < n_out; oc += tile) {
        tile = n_out - oc < k->tile_oc ? n_out - oc : k->tile_oc;
        for (int i = 0; i < n_in; i++)
            for (int t = 0; t < 9; t++)
                for (int o = 0; o < tile; o++)
                    *to++ = (float)w->weight[((oc + o) * n_in + i) * 9 + t];
    }
    k->wino_pack(u, packed, n_in, n_out, k->tile_oc);
    free(packed);
    return u;
}

/* All outputs in `parts` runs of tiles and groups of `group` channels; what was there before is added to where `add` says so. */
static void run(const struct work *w, const struct ggn_kernels *k, int parts, int group, const unsigned char *add)
{
    float bias[MOST], *u = pack(w, k), *scratch = malloc(ggn_wino_scratch(w->c.c_in) * sizeof *scratch);
    struct ggn_conv conv = {.x = w->x,
                            .y = w->y,
                            .bias = bias,
                            .add = add,
                            .n_in = w->c.c_in,
                            .n_out = w->c.c_out,
                            .taps = 9,
                            .h = w->c.h,
                            .w_px = w->c.w,
                            .row = w->c.w + 1,
                            .slope = 0.25f};
    const int tiles = ggn_wino_tiles(w->c.h, w->c.w);

    assert_non_null(scratch);
    for (int o = 0; o < w->c.c_out; o++) {
        bias[o] = (float)w->bias[o];
        for (int y = 0; y < w->c.h; y++)
            for (int x = 0; x < w->c.w; x++)
                w->y[o][y * (w->c.w + 1) + x] = 1;
    }
    for (int p = 0; p < parts; p++)
        for (int oc = 0; oc < w->c.c_out; oc += group)
            k->wino(&conv, u, tiles * p / parts, tiles * (p + 1) / parts, oc,
                    oc + group < w->c.c_out ? oc + group : w->c.c_out, scratch);
    free(u);
    free(scratch);
}

static void test_forward(void **state)
{
    for (uint32_t s = 0; s < N_SIZES; s++) {
        struct work w = begin(&sizes[s], 20 * s + 1);
        const int tiles = ggn_wino_tiles(w.c.h, w.c.w), least = (tiles + GGN_WINO_TILES - 1) / GGN_WINO_TILES;
        const int row = w.c.w + 1, plane = w.c.h * row, count = w.c.c_out * plane;
        float *first = NULL, *now = calloc((size_t)count, sizeof *now);
        unsigned char add[MOST] = {0};

        assert_non_null(now);
        add[w.c.c_out - 1] = 1;
        for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
            for (int cut = 0; cut < 3; cut++) {
                const struct ggn_kernels *k = ggn_kernels_for((enum base_isa)isa);
                if (!k || !k->wino)
                    continue;
                run(&w, k, least + 2 * cut, cut == 1 ? k->tile_oc : cut == 2 ? 16 : w.c.c_out, add);
                for (int i = 0; i < count; i++) {
                    const int o = i / plane, y = i % plane / row, x = i % row;
                    now[i] = w.y[o][y * row + x]; /* with the column behind the picture, which nobody writes */
                    near("forward", (enum base_isa)isa, (size_t)i, (double)now[i],
                         x == w.c.w ? 0 : w.out[(o * w.c.h + y) * w.c.w + x] + add[o], w.c.c_in);
                }
                if (!first) {
                    first = malloc((size_t)count * sizeof *first);
                    assert_non_null(first);
                    memcpy(first, now, (size_t)count * sizeof *first);
                }
                assert_memory_equal(now, first, (size_t)count * sizeof *now);
            }
        free(first);
        free(now);
        end(&w);
    }
    (void)state;
}

/* The gradient of the weights [c_out][c_in][9] in parts as large as the kernels take them. */
static void run_gradient(const struct work *w, const struct ggn_kernels *k, int mirrored, float *dw)
{
    float *scratch = malloc(GGN_WINO_GRAD_SCRATCH * sizeof *scratch);
    const int n_in = w->c.c_in, n_out = w->c.c_out;

    assert_non_null(scratch);
    for (int o = 0; o < n_out; o += GGN_WINO_GRAD)
        for (int i = 0; i < n_in; i += GGN_WINO_GRAD) {
            const struct ggn_conv_grad g = {.x = w->x + i,
                                            .dy = (const float *const *)w->y + o,
                                            .h = w->c.h,
                                            .w_px = w->c.w,
                                            .n_in = n_in - i < GGN_WINO_GRAD ? n_in - i : GGN_WINO_GRAD,
                                            .n_out = n_out - o < GGN_WINO_GRAD ? n_out - o : GGN_WINO_GRAD,
                                            .row = w->c.w + 1,
                                            .dw = dw + (o * n_in + i) * 9,
                                            .o_step = 9L * n_in,
                                            .i_step = 9,
                                            .mirrored = mirrored};
            k->wino_grad(&g, scratch);
        }
    free(scratch);
}

static void test_gradient(void **state)
{
    for (uint32_t s = 0; s < N_SIZES; s++) {
        struct work w = begin(&sizes[s], 20 * s + 5);
        const size_t count = (size_t)(9 * w.c.c_in * w.c.c_out);
        float *first = NULL, *dw = calloc(count + 1, sizeof *dw);

        assert_non_null(dw);
        for (int o = 0; o < w.c.c_out; o++)
            put(&w, w.y[o], w.dz + o * w.c.h * w.c.w);
        for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
            for (int mirrored = 0; mirrored < 2; mirrored++) {
                const struct ggn_kernels *k = ggn_kernels_for((enum base_isa)isa);
                if (!k || !k->wino_grad)
                    continue;
                dw[count] = 7;
                run_gradient(&w, k, mirrored, dw);
                assert_true(dw[count] == 7); /* whole vectors do not reach behind the weights */
                for (size_t i = 0; i < count; i++)
                    near("gradient", (enum base_isa)isa, i, (double)dw[i], w.dw[mirrored ? i / 9 * 9 + 8 - i % 9 : i],
                         w.c.h * w.c.w);
                if (!first) {
                    first = malloc(count * sizeof *first);
                    assert_non_null(first);
                    memcpy(first, dw, count * sizeof *first);
                }
                for (size_t i = 0; i < count; i++)
                    assert_true(dw[i] == first[mirrored ? i / 9 * 9 + 8 - i % 9 : i]);
            }
        free(first);
        free(dw);
        end(&w);
    }
    (void)state;
}

/* The weights of the shipped networks are transformed with AVX2, too. */
static void test_every_vector_unit(void **state)
{
    for (int isa = BASE_ISA_AVX2; isa < BASE_ISA_COUNT; isa++) {
        const struct ggn_kernels *k = ggn_kernels_for((enum base_isa)isa);
        assert_true(!k || (k->wino && k->wino_grad && k->wino_pack));
    }
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_forward), cmocka_unit_test(test_gradient),
                                       cmocka_unit_test(test_every_vector_unit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
