/* How fast the networks run on this machine, per layer and as medians: build/bench/ggn_networks --help */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/options.h"
#include "baselines/blas.h"
#include "sight/stats.h"
#include "model/inference.h"
#include "sight/measure.h"
#include "model/stopper.h"
#include "model/trainer.h"
#include "nn/hash.h"

enum { MAX_ROUNDS = 101, SGEMM_N = 768, BLOCKS = 16 };

struct options {
    const char *model;
    int json, threads, rounds, batch;
};
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"model", 0, "FILE", TO(model), .input = BASE_FILE,
     .help = "networks of the sizes of this model instead of the published ones"},
    {"json", 0, NULL, TO(json), .help = "one JSON object of medians instead of tables"},
    {"threads", 0, "N", TO(threads), 1, 1024, .help = "threads (all processors); with 1 the figures are processor time"},
    {"rounds", 0, "N", TO(rounds), 1, MAX_ROUNDS, .help = "measurements per figure (9)"},
    {"batch", 0, "N", TO(batch), 1, 64, .help = "batch of the training figures, which are per image or sample (4)"},
    {0}};

struct bench {
    struct options o;
    struct base_threads *threads;
    struct ggn_trainer *trainer;
    struct ggn_exec *all[GGN_NETS];      /* inference, on all threads */
    struct ggn_exec *(*alone)[GGN_NETS]; /* [threads] the same for each thread: criteria decide about blocks side by side */
    float *planes;                       /* random pictures */
    const float *noisy[64 * 3 * GGN_WINDOW_MAX], *reference[64 * 3], *noise_map[64];
};

enum {
    DENOISER,
    GENERATOR,
    DISCRIMINATOR,
    DECISION,
    BLOCKS_TOGETHER,
    BLOCKS_ALONE,
    DENOISER_TRAIN,
    GENERATOR_TRAIN,
    TRAIN_SAMPLE,
    SGEMM,
    N_FIGURES
};

static const char *const figure_name[N_FIGURES] = {
    "denoiser_forward_ms", "generator_forward_ms", "discriminator_forward_ms", "decision_ms",     "blocks_16_ms",
    "blocks_16_alone_ms",  "denoiser_train_ms",    "generator_train_ms",       "train_sample_ms", "sgemm_gflops",
};

/* The three networks, whose input is the first picture. */
static int create_networks(const struct bench *b, struct ggn_exec *e[GGN_NETS], struct base_threads *threads,
                           struct base_err *err)
{
    for (int net = 0; net < GGN_NETS; net++) {
        const struct ggn_graph *g = &b->trainer->graph[net];
        e[net] = ggn_exec_create(g, NULL, 1, 0, threads, err);
        if (!e[net])
            return err->code;
        for (int c = 0; c < g->value[0].c; c++)
            ggn_exec_load(e[net], 0, c, b->noisy[c], b->trainer->hyper.width);
    }
    return 0;
}

static int setup(struct bench *b, struct base_err *err)
{
    struct ggn_train_options options = ggn_train_options_default(GGN_PRESET_LULL);
    struct ggn_model *model = NULL;
    int rc = b->o.model ? ggn_model_load(b->o.model, &model, err) : 0;

    if (rc)
        return rc;
    /* The published sizes or those of a model; both presets are measured as the mended one, whose steps are simpler. */
    struct ggn_hyper hyper = model ? model->hyper : ggn_hyper_default(GGN_PRESET_LULL);
    hyper.preset = GGN_PRESET_LULL;
    ggn_model_destroy(model);
    const int area = hyper.width * hyper.height, window = 3 * hyper.window, planes = window + 3;
    options.batch = b->o.batch;
    b->threads = base_threads_create(b->o.threads, err);
    b->trainer = b->threads ? ggn_trainer_create(&hyper, &options, b->threads, err) : NULL;
    if (!b->trainer)
        return BASE_ENOMEM;
    b->planes = malloc((size_t)b->o.batch * (size_t)(planes * area) * sizeof *b->planes);
    b->alone = calloc((size_t)b->o.threads, sizeof *b->alone);
    if (!b->planes || !b->alone)
        return base_fail_nomem(err, "bench");
    for (int i = 0; i < b->o.batch; i++) {
        for (int c = 0; c < planes; c++) {
            float *plane = b->planes + (size_t)(i * planes + c) * (size_t)area;
            for (int k = 0; k < area; k++)
                plane[k] = (float)ggn_hash_unit((uint32_t)k, (uint32_t)(i * planes + c));
            *(c < window ? &b->noisy[i * window + c] : &b->reference[i * 3 + c - window]) = plane;
        }
        b->noise_map[i] = b->reference[3 * i];
    }
    rc = create_networks(b, b->all, b->threads, err);
    for (int i = 0; i < b->o.threads && !rc; i++)
        rc = create_networks(b, b->alone[i], NULL, err);
    return rc;
}

static void release(struct bench *b)
{
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_exec_destroy(b->all[net]);
        for (int i = 0; b->alone && i < b->o.threads; i++)
            ggn_exec_destroy(b->alone[i][net]);
    }
    free(b->alone);
    ggn_trainer_destroy(b->trainer);
    base_threads_destroy(b->threads);
    free(b->planes);
}

/* On one thread the processor's time, which other jobs on the machine change little. */
static double now_s(const struct bench *b) { return b->o.threads == 1 ? base_clock_thread_s() : base_clock_wall_s(); }

static double forward_ms(struct bench *b, int net)
{
    double start = now_s(b);
    ggn_exec_forward(b->all[net], b->trainer->weights[net], 1, GGN_EVAL);
    return 1e3 * (now_s(b) - start);
}

static void decide(void *data, long block, int worker)
{
    static const int passes[] = {GGN_NET_R, GGN_NET_M, GGN_NET_M, GGN_NET_D};
    struct bench *b = data;
    (void)block;
    for (size_t i = 0; i < sizeof passes / sizeof passes[0]; i++)
        ggn_exec_forward(b->alone[worker][passes[i]], b->trainer->weights[passes[i]], 1, GGN_EVAL);
}

/* Decisions about BLOCKS blocks, side by side by all threads or one after the other by one. */
static double blocks_ms(struct bench *b, int together)
{
    double start = now_s(b);
    if (together)
        base_threads_for(b->threads, BLOCKS, decide, b);
    else
        for (long i = 0; i < BLOCKS; i++)
            decide(b, i, 0);
    return 1e3 * (now_s(b) - start);
}

static double denoiser_train_ms(struct bench *b, struct base_err *err)
{
    double loss, start = now_s(b);
    const float *x[64 * 3];

    for (int i = 0; i < 3 * b->o.batch; i++)
        x[i] = b->noisy[i / 3 * 3 * b->trainer->hyper.window + i % 3];
    if (ggn_trainer_denoiser_step(b->trainer, x, b->reference, b->o.batch, &loss, err))
        return 0;
    return 1e3 * (now_s(b) - start) / b->o.batch;
}

/* Generator and discriminator on both windows of each sample. */
static double judge_train_ms(struct bench *b, struct base_err *err)
{
    static const double law[64];
    static const float nothing[GGN_SCALARS];
    const float *scalars[64];
    double label[64], bce, start = now_s(b);
    struct ggn_batch batch = {.count = b->o.batch,
                              .noisy = b->noisy,
                              .denoised = b->noisy,
                              .noise_map = b->noise_map,
                              .scalars = scalars,
                              .law = law,
                              .label = label};

    for (int i = 0; i < b->o.batch; i++) {
        label[i] = i & 1;
        scalars[i] = nothing;
    }
    if (ggn_trainer_classifier_step(b->trainer, &batch, &bce, NULL, err))
        return 0;
    return 1e3 * (now_s(b) - start) / b->o.batch;
}

static double generator_train_ms(struct bench *b)
{
    struct ggn_exec *m = b->trainer->m;
    double start = now_s(b);

    ggn_exec_forward(m, b->trainer->weights[GGN_NET_M], b->o.batch, GGN_TRAIN);
    ggn_exec_backward(m, b->trainer->weights[GGN_NET_M], b->trainer->grad[GGN_NET_M]);
    return 1e3 * (now_s(b) - start) / b->o.batch;
}

static double sgemm_gflops(const struct bench *b, float *memory)
{
    float *x = memory, *y = x + SGEMM_N * SGEMM_N, *z = y + SGEMM_N * SGEMM_N;

    ggn_blas_threads(b->o.threads);
    double start = now_s(b);
    ggn_blas_sgemm(CblasNoTrans, CblasNoTrans, SGEMM_N, SGEMM_N, SGEMM_N, x, y, 0, z);
    double elapsed = now_s(b) - start;
    ggn_blas_threads(1);
    return 2e-9 * SGEMM_N * SGEMM_N * SGEMM_N / elapsed;
}

static int measure(struct bench *b, double figure[N_FIGURES], struct base_err *err)
{
    double sample[N_FIGURES][MAX_ROUNDS];
    float *gemm = calloc((size_t)3 * SGEMM_N * SGEMM_N, sizeof *gemm);

    if (!gemm)
        return base_fail_nomem(err, "sgemm");
    if (ggn_blas_open(err) != 0) {
        free(gemm);
        return BASE_EINVAL;
    }
    for (int i = -1; i < b->o.rounds; i++) { /* round −1 warms up */
        int k = i < 0 ? 0 : i;
        sample[DENOISER][k] = forward_ms(b, GGN_NET_R);
        sample[GENERATOR][k] = forward_ms(b, GGN_NET_M);
        sample[DISCRIMINATOR][k] = forward_ms(b, GGN_NET_D);
        sample[DECISION][k] =
            forward_ms(b, GGN_NET_R) + forward_ms(b, GGN_NET_M) + forward_ms(b, GGN_NET_M) + forward_ms(b, GGN_NET_D);
        sample[BLOCKS_TOGETHER][k] = blocks_ms(b, 1);
        sample[BLOCKS_ALONE][k] = blocks_ms(b, 0);
        sample[SGEMM][k] = sgemm_gflops(b, gemm);
    }
    for (int i = -1; i < (b->o.rounds + 2) / 3; i++) {
        int k = i < 0 ? 0 : i;
        sample[DENOISER_TRAIN][k] = denoiser_train_ms(b, err);
        sample[GENERATOR_TRAIN][k] = generator_train_ms(b);
        sample[TRAIN_SAMPLE][k] = b->trainer->hyper.window * sample[DENOISER_TRAIN][k] + judge_train_ms(b, err);
    }
    for (int f = 0; f < N_FIGURES; f++)
        figure[f] = ggn_stats_quantile(
            sample[f], (size_t)(f >= DENOISER_TRAIN && f <= TRAIN_SAMPLE ? (b->o.rounds + 2) / 3 : b->o.rounds), 0.5);
    free(gemm);
    return err->code;
}

/* Of each layer the shortest of the rounds: what other jobs on the machine do only makes it longer. */
static void time_layers(const struct bench *b, int net, double shortest_s[GGN_MAX_LAYERS])
{
    struct ggn_exec *e = b->all[net];
    double s[GGN_MAX_LAYERS];

    for (int k = 0; k < b->o.rounds; k++) {
        memset(s, 0, sizeof s);
        e->layer_s = s;
        ggn_exec_forward(e, b->trainer->weights[net], 1, GGN_EVAL);
        e->layer_s = NULL;
        for (int i = 0; i < e->graph->n_layers; i++)
            shortest_s[i] = k == 0 || s[i] < shortest_s[i] ? s[i] : shortest_s[i];
    }
}

static void print_layers(const struct bench *b, int net)
{
    const struct ggn_graph *g = b->all[net]->graph;
    double s[GGN_MAX_LAYERS], total = 0;

    time_layers(b, net, s);
    printf("%s: %.3f GFLOP\n%-7s %-11s %14s %9s %9s %9s\n", g->name, 2e-9 * ggn_graph_mac(g), "stage", "layer", "output",
           "GFLOP", "ms", "GFLOP/s");
    for (int i = 0; i < g->n_layers; i++) {
        const struct ggn_layer *l = &g->layer[i];
        const struct ggn_value *v = &g->value[l->out];
        double flop = 2 * ggn_layer_mac(g, i), ms = 1e3 * s[i];
        char shape[32];
        snprintf(shape, sizeof shape, "%dx%dx%d", v->c, v->h, v->w);
        total += ms;
        if (ms > 0)
            printf("%-7s %-11s %14s %9.4f %9.3f %9.1f\n", l->stage, ggn_op_name(l->op), shape, 1e-9 * flop, ms,
                   1e-6 * flop / ms);
    }
    printf("%-7s %-11s %14s %9.4f %9.3f %9.1f\n\n", "all", "", "", 2e-9 * ggn_graph_mac(g), total,
           2e-6 * ggn_graph_mac(g) / total);
}

static void print_figures(const struct bench *b, const double figure[N_FIGURES])
{
    if (!b->o.json) {
        for (int f = 0; f < N_FIGURES; f++)
            printf("%-26s %9.3f\n", figure_name[f], figure[f]);
        return;
    }
    printf("{\"threads\": %d, \"isa\": \"%s\", \"batch\": %d", b->o.threads, base_isa_name(b->all[0]->kernels->isa),
           b->o.batch);
    for (int f = 0; f < N_FIGURES; f++)
        printf(", \"%s\": %.3f", figure_name[f], figure[f]);
    printf("}\n");
}

static int run(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {.list = list, .doc = "Measures inference and training of the networks."};
    struct bench b = {.o = {.threads = base_threads_available(), .rounds = 9, .batch = 4}};
    double figure[N_FIGURES];

    int rc = base_options_parse(&options, argc, argv, &b.o, err);
    if (!rc)
        rc = setup(&b, err);
    if (!rc && !b.o.json) {
        printf("instruction set %s, %d threads\n\n", base_isa_name(b.all[0]->kernels->isa), b.o.threads);
        for (int net = 0; net < GGN_NETS; net++)
            print_layers(&b, net);
    }
    if (!rc)
        rc = measure(&b, figure, err);
    if (!rc)
        print_figures(&b, figure);
    release(&b);
    return rc;
}

int main(int argc, char **argv)
{
    struct base_err err = {0};
    int rc = run(argc, argv, &err);
    if (rc)
        fprintf(stderr, "%s: %s\n", argv[0], err.text);
    return rc ? 2 : 0;
}
