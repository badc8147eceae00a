/*
 * What the networks are made of: every layer, value and tensor of both presets as recorded in tests/unit/ggn_nn_networks.txt, the first
 * weights by their formulas, memory, the choice of the instruction set, and what is refused.
 */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/inference.h"
#include "model/networks.h"
#include "nn/exec.h"
#include "nn/hash.h"
#include "nn/winograd.h"
#include "support/approve.h"

static struct ggn_graph graph;

static void put_graph(FILE *f, const struct ggn_graph *g)
{
    static const char nothing[] = "-";
    size_t offset[GGN_MAX_LAYERS + 1];

    fprintf(f, "> %s: params %zu stats %zu learned %zu pack %zu acts %zu, for inference %zu, %.0f multiplications\n",
            g->name, g->n_params, g->n_stats, g->n_learned, g->n_pack, g->n_acts, ggn_graph_place(g, offset),
            ggn_graph_mac(g));
    for (int i = 0; i < g->n_values; i++) {
        const struct ggn_value *v = &g->value[i];
        fprintf(f, "value %d: %d x %d x %d flat %d row %d origin %zu plane %zu size %zu at %zu, %zu, used %d, %s\n", i, v->c,
                v->h, v->w, v->flat, v->row, v->origin, v->plane, v->size, v->offset, offset[i], v->uses,
                v->stage ? v->stage : nothing);
    }
    for (int i = 0; i < g->n_layers; i++) {
        const struct ggn_layer *l = &g->layer[i];
        fprintf(
            f,
            "layer %d: %s %d %d to %d kernel %d stride %d pad %d, %d, %d transposed %d slope %g drop %g weight %zu bias %zu "
            "pack %zu stats %zu add %d %d, in %d, %.0f multiplications, %s\n",
            i, ggn_op_name(l->op), l->in, l->in2, l->out, l->kernel, l->stride, l->pad, l->pad_y, l->pad_x, l->transposed,
            l->slope, l->drop, l->weight, l->bias, l->pack, l->stats, l->add_in, l->add_in2, ggn_layer_c_in(g, l),
            ggn_layer_mac(g, i), l->stage);
    }
    for (int i = 0; i < g->n_tensors; i++) {
        const struct ggn_tensor *t = &g->tensor[i];
        fprintf(f, "tensor %d: %s [%d: %d %d %d %d] at %zu, %zu, layer %d bias %d bn %d\n", i, t->name, t->ndim, t->dim[0],
                t->dim[1], t->dim[2], t->dim[3], t->offset, t->count, t->layer, t->is_bias, t->is_bn);
    }
}

/* The published networks, small ones of odd sizes that take the noise map, and what they need in memory. */
static void structure(void **state)
{
    const struct ggn_hyper published = ggn_hyper_default(GGN_PRESET_PAPER),
                           odd = {GGN_PRESET_LULL, 37, 51, 2, 3, 5, 2, 1, 0, 0};
    const struct ggn_hyper *const hypers[] = {&published, &odd};
    static const int flags[] = {0, GGN_EXEC_NO_FUSE, GGN_EXEC_GRADS, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD};
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    (void)state;

    setenv("LULL_ISA", "base", 1);
    for (int h = 0; h < 2; h++)
        for (int net = 0; net < GGN_NETS; net++) {
            assert_int_equal(ggn_network_build(&graph, net, hypers[h], NULL), 0);
            put_graph(f, &graph);
            for (int k = 0; k < 4; k++) /* without the struct, which may grow */
                fprintf(f, "flags %d: %zu bytes, batch of 5 on two threads %zu\n", flags[k],
                        ggn_exec_bytes(&graph, 1, flags[k], 1) - sizeof(struct ggn_exec),
                        ggn_exec_bytes(&graph, 5, flags[k], 2) - sizeof(struct ggn_exec));
        }
    struct ggn_model *model = ggn_model_create(&odd, NULL);
    fprintf(f, "a judge: %zu bytes, with two threads %zu\n", ggn_inference_bytes(model, 1), ggn_inference_bytes(model, 2));
    ggn_model_destroy(model);
    unsetenv("LULL_ISA");
    fclose(f);
    approve_text("tests/unit/ggn_nn_networks.txt", text);
    free(text);
}

/* Scratch is as large as the largest task of any layer needs, in every form that the kernels have. */
static void scratch(void **state)
{
    for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
        for (int k = 0; k < 6; k++) {
            const struct ggn_kernels *kernels = ggn_kernels_for((enum base_isa)isa);
            const int in = k < 3 ? 9 : 60, out = k % 3 == 0 ? 9 : 70, wide = k % 3 == 1;
            static const int flags[] = {0, GGN_EXEC_GRADS};
            for (int m = 0; m < 2 && kernels; m++) {
                ggn_graph_begin(&graph, "scratch", in, 30, wide ? 900 : 30);
                ggn_graph_stage(&graph, "a");
                ggn_graph_conv(&graph, 0, -1, out, 3, 0, 1);
                assert_int_equal(ggn_graph_end(&graph, NULL), 0);
                struct ggn_exec *e = ggn_exec_create(&graph, kernels, 1, flags[m], NULL, NULL);
                const int lanes = kernels->lanes, grads = flags[m] & GGN_EXEC_GRADS;
                size_t need = (size_t)(kernels->tile_oc * GGN_GRAD_IC * 9 * lanes) * (grads != 0);
                if (kernels->wino && ggn_wino_suits(in, out, 30, wide ? 900 : 30, lanes)) {
                    size_t forward = ggn_wino_scratch(in), back = grads ? ggn_wino_scratch(out) : 0;
                    need = need > forward ? need : forward;
                    need = need > back ? need : back;
                }
                if (kernels->wino_grad && grads && need < GGN_WINO_GRAD_SCRATCH)
                    need = GGN_WINO_GRAD_SCRATCH;
                assert_true(e && e->scratch_size >= need && e->scratch_size % 16 == 0);
                /* one worker's does not reach into the other's, nor the last one's into the statistics */
                assert_true(e->bn_mean - e->scratch == (ptrdiff_t)e->scratch_size);
                assert_int_equal((size_t)e->acts % 64, 0);
                ggn_exec_destroy(e);
            }
        }
    (void)state;
}

/* Which convolutions are worth the transforms, and how their tiles are shared out. */
static void winograd(void **state)
{
    /* the answers with 16 lanes and with 8, for the convolution and for its weights' gradient */
    static const int suits[][7] = {
        {6, 34, 24, 16, 1, 1, 1},  {5, 200, 24, 16, 0, 1, 0}, {34, 6, 24, 16, 1, 1, 1},  {200, 5, 24, 16, 0, 1, 0},
        {14, 14, 24, 16, 0, 1, 1}, {10, 20, 24, 16, 1, 1, 1}, {10, 20, 20, 16, 0, 1, 1}, {10, 20, 21, 13, 1, 1, 1},
        {10, 20, 1, 96, 1, 1, 1},  {10, 20, 1, 92, 0, 1, 1},  {3, 11, 12, 12, 0, 1, 0},  {2, 40, 12, 12, 0, 0, 0},
        {40, 2, 12, 12, 0, 0, 0},  {4, 8, 12, 12, 0, 1, 0},   {31, 1, 12, 12, 0, 0, 0},  {3, 10, 12, 12, 0, 0, 0},
        {6, 10, 12, 12, 0, 1, 1},  {6, 9, 12, 12, 0, 1, 0},   {20, 20, 8, 16, 0, 0, 0},  {20, 20, 9, 9, 0, 1, 1}};
    static const int cuts[][4] = {{24, 63, 2, 63}, {64, 63, 2, 63},  {64, 64, 1, 32},  {9, 80, 1, 40},   {9, 90, 1, 48},
                                  {65, 64, 4, 64}, {128, 64, 4, 64}, {256, 20, 4, 20}, {257, 20, 5, 20}, {2500, 16, 40, 16}};
    (void)state;

    for (size_t i = 0; i < sizeof suits / sizeof suits[0]; i++)
        for (int k = 0; k < 2; k++) {
            const int lanes = k ? 8 : 16, *s = suits[i];
            assert_int_equal(ggn_wino_suits(s[0], s[1], s[2], s[3], lanes), s[4 + k]);
            assert_int_equal(ggn_wino_grad_suits(s[0], s[1], s[2], s[3], lanes), k ? s[6] : s[4]);
        }
    for (size_t i = 0; i < sizeof cuts / sizeof cuts[0]; i++) {
        int blocks, group;
        ggn_wino_cut(cuts[i][0], cuts[i][1], &blocks, &group);
        assert_int_equal(blocks, cuts[i][2]);
        assert_int_equal(group, cuts[i][3]);
    }
    assert_int_equal(ggn_wino_tiles(200, 197), 2500);
    assert_int_equal(ggn_wino_tiles(5, 4), 2);
}

/* --- first weights --------------------------------------------------------------------------------------------------------------------- */

static double uniform(size_t k, uint32_t seed) { return 2 * ggn_hash_unit((uint32_t)k, seed) - 1; }

static double normal(size_t k, uint32_t seed)
{
    return sqrt(-2 * log(1 - ggn_hash_unit(2 * (uint32_t)k, seed))) *
           cos(2 * 3.141592653589793 * ggn_hash_unit(2 * (uint32_t)k + 1, seed));
}

/* What element k of a tensor begins as; fan: inputs of one of its outputs. */
static double initial(const struct ggn_tensor *t, enum ggn_init init, double fan, size_t k, uint32_t seed)
{
    const int weight = !t->is_bias;

    switch (init) {
    case GGN_INIT_HASH:
        return t->is_bias ? 0.1 * uniform(k, seed)
               : t->is_bn ? 1 + 0.1 * uniform(k, seed)
                          : uniform(k, seed) * sqrt(6 / fan);
    case GGN_INIT_PAPER: return t->is_bn ? weight : uniform(k, seed) / sqrt(fan);
    case GGN_INIT_GAN:
        return t->is_bn && weight       ? 1 + 0.02 * normal(k, seed)
               : t->is_bn               ? 0
               : weight && t->ndim == 4 ? 0.02 * normal(k, seed)
                                        : uniform(k, seed) / sqrt(fan);
    case GGN_INIT_HE: return t->is_bn ? weight : weight ? normal(k, seed) * sqrt(2 / ((1 + 0.04) * fan)) : 0;
    }
    return (double)NAN;
}

static void first_weights(void **state)
{
    const struct ggn_hyper hyper = {GGN_PRESET_LULL, 32, 35, 2, 3, 4, 3, 0, 0, 0};
    (void)state;

    for (int net = 0; net < GGN_NETS; net++)
        for (int init = GGN_INIT_HASH; init <= GGN_INIT_HE; init++) {
            assert_int_equal(ggn_network_build(&graph, net, &hyper, NULL), 0);
            struct ggn_weights *w = ggn_weights_create(&graph, NULL, 0, NULL);
            double fan = 0;
            assert_non_null(w);
            for (size_t i = 0; i < graph.n_stats; i++)
                w->mean[i] = w->var[i] = 7;
            ggn_weights_init(w, (enum ggn_init)init, 40);
            for (int i = 0; i < graph.n_tensors; i++) {
                const struct ggn_tensor *t = &graph.tensor[i];
                const int in = graph.layer[t->layer].transposed ? 0 : 1; /* which dimension; biases have their weight's */
                if (t->ndim > 1)
                    fan = t->dim[in] * (t->ndim == 4 ? t->dim[2] * t->dim[3] : 1);
                for (size_t k = 0; k < t->count; k++) {
                    double got = (double)w->params[t->offset + k],
                           want = initial(t, (enum ggn_init)init, fan, k, 40 + (uint32_t)i);
                    if (!(fabs(got - want) <= 1e-6 * fmax(1, fabs(want))))
                        fail_msg("%s, %s[%zu]: %g, not %g", graph.name, t->name, k, got, want);
                }
            }
            for (size_t i = 0; i < graph.n_stats; i++)
                assert_true(w->mean[i] == 0 && w->var[i] == 1);
            ggn_weights_destroy(w);
        }
}

/* Batch norm as a factor and a shift; arrays that do not meet; the backward form only where it was asked for. */
static void packed(void **state)
{
    const struct ggn_hyper hyper = {GGN_PRESET_LULL, 32, 35, 2, 8, 8, 3, 0, 0, 0};
    (void)state;

    assert_int_equal(ggn_network_build(&graph, GGN_NET_M, &hyper, NULL), 0);
    for (int back = 0; back < 2; back++) {
        struct ggn_weights *w = ggn_weights_create(&graph, NULL, back ? GGN_WEIGHTS_BACKWARD : 0, NULL);
        assert_non_null(w);
        assert_true((w->pack_back != NULL) == back && (size_t)w->params % 64 == 0);
        const float *const starts[] = {w->params + graph.n_params + 2 * graph.n_stats,
                                       w->scale,
                                       w->scale + graph.n_stats,
                                       w->shift,
                                       w->shift + graph.n_stats,
                                       w->pack,
                                       w->pack + graph.n_pack,
                                       w->wino ? w->wino : w->pack_back,
                                       w->wino ? w->wino + 4 * graph.n_pack : NULL,
                                       w->wino ? w->pack_back : NULL,
                                       back ? w->pack_back + graph.n_pack : NULL,
                                       w->wino_back};
        for (size_t i = 1; i < sizeof starts / sizeof starts[0]; i++)
            assert_true(!starts[i] || !starts[i - 1] || starts[i] >= starts[i - 1]);
        for (size_t i = 0; i < graph.n_stats; i++)
            assert_true(w->mean[i] == 0 && w->var[i] == 1);
        ggn_weights_init(w, GGN_INIT_HASH, 3);
        for (size_t i = 0; i < graph.n_stats; i++) {
            w->mean[i] = (float)uniform(i, 1);
            w->var[i] = (float)(1.1 + uniform(i, 2));
        }
        ggn_weights_pack(w, NULL);
        for (int i = 0; i < graph.n_layers; i++)
            for (size_t c = 0; graph.layer[i].op == GGN_OP_BN && c < (size_t)graph.value[graph.layer[i].out].c; c++) {
                const struct ggn_layer *l = &graph.layer[i];
                double scale = (double)w->params[l->weight + c] / sqrt((double)w->var[l->stats + c] + 1e-5);
                double shift = (double)w->params[l->bias + c] - scale * (double)w->mean[l->stats + c];
                assert_true(fabs((double)w->scale[l->stats + c] - scale) < 1e-6 &&
                            fabs((double)w->shift[l->stats + c] - shift) < 1e-6);
            }
        ggn_weights_destroy(w);
    }
}

/* --- instruction sets ------------------------------------------------------------------------------------------------------------------ */

static void instruction_sets(void **state)
{
    static const char *const names[] = {"base", "avx2", "avx512"};
    const enum base_isa best = (unsetenv("LULL_ISA"), base_isa_best());
    (void)state;

    assert_true(base_isa_available(BASE_ISA_BASE) && base_isa_available(best) && !base_isa_available(BASE_ISA_COUNT));
    for (int i = 0; i < BASE_ISA_COUNT; i++) {
        assert_string_equal(base_isa_name((enum base_isa)i), names[i]);
        assert_true(i <= (int)best || !base_isa_available((enum base_isa)i));
        setenv("LULL_ISA", names[i], 1);
        assert_int_equal(base_isa_best(), i < (int)best ? i : (int)best);
        assert_ptr_equal(ggn_kernels_best(), ggn_kernels_for(base_isa_best()));
        if (base_isa_available((enum base_isa)i))
            assert_int_equal(ggn_kernels_for((enum base_isa)i)->isa, i);
        else
            assert_null(ggn_kernels_for((enum base_isa)i));
    }
    setenv("LULL_ISA", "avx", 1); /* none of them: the best */
    assert_int_equal(base_isa_best(), best);
    unsetenv("LULL_ISA");
}

/* --- what is refused ------------------------------------------------------------------------------------------------------------------- */

static void refused(int rc, const struct base_err *err, const char *want)
{
    assert_int_equal(rc, BASE_EINVAL);
    assert_string_equal(err->text, want);
}

static void ranges(void **state)
{
    static const struct {
        const char *name;
        size_t at;
        int min, max;
    } fields[] = {
        {"preset", offsetof(struct ggn_hyper, preset), 0, 1},   {"height", offsetof(struct ggn_hyper, height), 16, 1024},
        {"width", offsetof(struct ggn_hyper, width), 16, 1024}, {"window", offsetof(struct ggn_hyper, window), 1, 16},
        {"k_r", offsetof(struct ggn_hyper, k_r), 1, 128},       {"k_m", offsetof(struct ggn_hyper, k_m), 1, 128},
        {"k_d", offsetof(struct ggn_hyper, k_d), 1, 64},        {"picture", offsetof(struct ggn_hyper, noise_map), 0, 1}};
    (void)state;

    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++)
        for (int value = fields[i].min - 1; value <= fields[i].max + 1;
             value += value == fields[i].min ? fields[i].max - value : 1) {
            struct ggn_hyper h = {GGN_PRESET_LULL, 20, 20, 2, 3, 3, 3, 0, 0, 0};
            struct base_err err = {0};
            char want[96];
            memcpy((char *)&h + fields[i].at, &value, sizeof value);
            int good = value >= fields[i].min && value <= fields[i].max, rc = ggn_hyper_check(&h, &err);
            snprintf(want, sizeof want, "hyper-parameter %s = %d is not in %d..%d", fields[i].name, value, fields[i].min,
                     fields[i].max);
            if (good)
                assert_int_equal(rc, 0);
            else
                refused(rc, &err, want);
            assert_int_equal(ggn_network_build(&graph, GGN_NET_D, &h, NULL), rc);
        }
    const struct ggn_hyper d = ggn_hyper_default(GGN_PRESET_LULL);
    assert_true(d.preset == GGN_PRESET_LULL && d.height == 200 && d.width == 200 && d.window == 6 && d.k_r == 16 &&
                d.k_m == 20);
    assert_true(d.k_d == 64 && d.noise_map == 0);
}

static int sized(int c, int h, int w, struct base_err *err)
{
    *err = (struct base_err){0};
    ggn_graph_begin(&graph, "n", c, h, w);
    return ggn_graph_end(&graph, err);
}

static void graphs(void **state)
{
    struct base_err err;
    int x = 0;
    (void)state;

    assert_int_equal(sized(1, 1, 1, &err) | sized(4096, 1, 1, &err) | sized(1, 2048, 2048, &err), 0);
    refused(sized(0, 1, 1, &err), &err, "network n, stage input: a tensor of 0×1×1 is out of range");
    refused(sized(1, 0, 1, &err), &err, "network n, stage input: a tensor of 1×0×1 is out of range");
    refused(sized(1, 1, 0, &err), &err, "network n, stage input: a tensor of 1×1×0 is out of range");
    refused(sized(4097, 1, 1, &err), &err, "network n, stage input: a tensor of 4097×1×1 is out of range");
    refused(sized(1, 2049, 1, &err), &err, "network n, stage input: a tensor of 1×2049×1 is out of range");
    refused(sized(1, 1, 2049, &err), &err, "network n, stage input: a tensor of 1×1×2049 is out of range");
    for (int layers = GGN_MAX_LAYERS; layers <= GGN_MAX_LAYERS + 1; layers++) {
        ggn_graph_begin(&graph, "n", 1, 4, 4);
        for (int i = 0, at = 0; i < layers; i++)
            at = ggn_graph_sigmoid(&graph, at);
        int rc = ggn_graph_end(&graph, &err);
        if (layers > GGN_MAX_LAYERS)
            refused(rc, &err, "network n: more than 96 layers");
        else
            assert_int_equal(rc, 0);
    }
    for (int layers = 64; layers <= 65; layers++) {
        ggn_graph_begin(&graph, "n", 1, 4, 4);
        ggn_graph_stage(&graph, "s");
        for (int i = 0, at = 0; i < layers; i++)
            at = ggn_graph_bn(&graph, at);
        int rc = ggn_graph_end(&graph, &err);
        if (layers > 64)
            refused(rc, &err, "network n: more than 128 tensors");
        else
            assert_int_equal(rc, 0);
    }
    for (int axis = 0; axis < 2; axis++) {
        ggn_graph_begin(&graph, "n", 1, 4, 4);
        ggn_graph_stage(&graph, "s");
        x = ggn_graph_up(&graph, 0, axis, !axis);
        x = ggn_graph_maxpool(&graph, x, 2);
        assert_int_equal(ggn_graph_end(&graph, &err), 0);
        x = ggn_graph_up(&graph, 0, axis, !axis);
        ggn_graph_conv(&graph, x, ggn_graph_up(&graph, 0, 0, 0), 2, 3, 0, 1);
        refused(ggn_graph_end(&graph, &err), &err, "network n, stage s: joined tensors differ in size");
    }
    ggn_graph_begin(&graph, "n", 1, 4, 4);
    ggn_graph_stage(&graph, "s");
    ggn_graph_dropout(&graph, 0, 0.5);
    refused(ggn_graph_end(&graph, &err), &err, "network n, stage s: dropout of planes, not of a vector");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(structure), cmocka_unit_test(scratch),
                                       cmocka_unit_test(winograd),  cmocka_unit_test(first_weights),
                                       cmocka_unit_test(packed),    cmocka_unit_test(instruction_sets),
                                       cmocka_unit_test(ranges),    cmocka_unit_test(graphs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
