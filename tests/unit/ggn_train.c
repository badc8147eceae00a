/* What a run begins with and how it goes: folding, the denoiser, plans, learning rates, learning curves. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "nn/exec.h"
#include "train/session.h"
#include "train/start.h"
#include "nn/hash.h"

/* The generator on differences and the folded one on plain images give the same map. */
static void folding_keeps_the_function(void **state)
{
    struct ggn_hyper hyper = {
        .preset = GGN_PRESET_LULL, .height = 32, .width = 32, .window = 3, .k_r = 3, .k_m = 3, .k_d = 2};
    struct ggn_graph *g = malloc(sizeof *g);
    struct base_err err = {0};
    float out[2][32 * 32], before[1];

    assert_int_equal(ggn_network_build(g, GGN_NET_M, &hyper, &err), 0);
    struct ggn_weights *w = ggn_weights_create(g, NULL, 0, &err);
    struct ggn_exec *e = ggn_exec_create(g, NULL, 1, 0, NULL, &err);
    ggn_weights_init(w, GGN_INIT_HE, 5);
    before[0] = w->params[10];
    for (int fold = 0; fold < 2; fold++) {
        if (fold)
            ggn_train_fold(g, w->params, 3, 8, 0);
        ggn_weights_pack(w, NULL);
        for (int k = 0; k < 9; k++)
            for (int y = 0; y < 32; y++)
                for (int x = 0; x < 32; x++) {
                    double v = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)k);
                    double newest = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)(6 + k % 3));
                    ggn_exec_plane(e, 0, 0, k)[y * g->value[0].row + x] = (float)(fold || k > 5 ? v : 8 * (v - newest));
                }
        ggn_exec_forward(e, w, 1, GGN_EVAL);
        for (int y = 0; y < 32; y++)
            memcpy(out[fold] + 32 * y, ggn_exec_plane(e, g->n_values - 1, 0, 0) + y * g->value[g->n_values - 1].row,
                   32 * sizeof(float));
    }
    for (int i = 0; i < 32 * 32; i++)
        assert_float_equal(out[0][i], out[1][i], 1e-4);
    ggn_train_fold(g, w->params, 3, 8, 1);
    assert_float_equal(w->params[10], before[0], 1e-5);
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
    free(g);
    (void)state;
}

/* The denoiser begins as sigmoid(4·(x − 1/2)), up to what the random channels add. */
static void the_denoiser_begins_near_its_input(void **state)
{
    struct ggn_hyper hyper = {
        .preset = GGN_PRESET_LULL, .height = 32, .width = 32, .window = 6, .k_r = 8, .k_m = 3, .k_d = 2};
    struct ggn_graph *g = malloc(sizeof *g);
    struct base_err err = {0};
    double error = 0;

    assert_int_equal(ggn_network_build(g, GGN_NET_R, &hyper, &err), 0);
    struct ggn_weights *w = ggn_weights_create(g, NULL, 0, &err);
    struct ggn_exec *e = ggn_exec_create(g, NULL, 1, 0, NULL, &err);
    ggn_weights_init(w, GGN_INIT_HE, 5);
    ggn_train_identity(g, w->params);
    ggn_weights_pack(w, NULL);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < 3; k++)
            for (int y = 0; y < 32; y++)
                for (int x = 0; x < 32; x++) {
                    double v = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)k);
                    if (!pass)
                        ggn_exec_plane(e, 0, 0, k)[y * g->value[0].row + x] = (float)v;
                    else
                        error +=
                            fabs((double)ggn_exec_plane(e, g->n_values - 1, 0, k)[y * g->value[g->n_values - 1].row + x] -
                                 1 / (1 + exp(2 - 4 * v))) /
                            (3 * 32 * 32);
                }
        if (!pass)
            ggn_exec_forward(e, w, 1, GGN_EVAL);
    }
    assert_true(error < 0.06);
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
    free(g);
    (void)state;
}

/* --- numbers of a plan, and what is fitted: closed forms ------------------------------------------------------------------ */

/* Every number of both presets' plans, in the order of the struct. */
static void default_plans(void **state)
{
    static const struct {
        double ratio;
        int window, k[3], crop, batch_r, batch, steps, epochs, epoch_steps, patience;
        double lr, difference;
        int soft, flips;
        double jitter;
        int synthetic, extend;
    } want[] = {{0, 6, {16, 20, 64}, 0, 16, 64, 0, 30, 0, 0, 2e-4, 0, 0, 0, 0, 0, 0},
                {1.1, 6, {8, 10, 32}, 0, 16, 16, 2000, 30, 100, 8, 1e-3, 8, 1, 1, 0.3, 1, 1}};

    for (int preset = 0; preset < 2; preset++) {
        const struct ggn_train_plan p = ggn_train_plan_default((enum ggn_preset)preset);
        assert_true(p.hyper.preset == (enum ggn_preset)preset && p.data.ratio == want[preset].ratio && !p.data.dir);
        assert_true(!p.out && !p.init && !p.resume && !p.progress && !p.interrupted);
        assert_true(p.hyper.window == want[preset].window && p.hyper.k_r == want[preset].k[0] &&
                    p.hyper.k_m == want[preset].k[1]);
        assert_true(p.hyper.k_d == want[preset].k[2] && p.crop == want[preset].crop && p.batch_r == want[preset].batch_r);
        assert_true(p.batch == want[preset].batch && p.steps == want[preset].steps && p.steps_r == p.steps);
        assert_true(p.epochs == want[preset].epochs && p.epoch_steps == want[preset].epoch_steps);
        assert_true(p.patience == want[preset].patience && p.lr == want[preset].lr && p.lr_r == p.lr);
        assert_true(p.difference == want[preset].difference && p.soft_labels == want[preset].soft);
        assert_true(p.flips == want[preset].flips && p.jitter == want[preset].jitter && p.noise_map == 0);
        assert_true(p.synthetic == want[preset].synthetic && p.extend == want[preset].extend && p.seed == 1);
        assert_true(p.validation_windows == 400 && p.early_rate == 0.02 && p.threads == 0);
        const struct ggn_train_options o = ggn_train_options_default((enum ggn_preset)preset);
        assert_true(o.parts == GGN_TRAIN_ALL && o.batch == want[preset].batch && o.beta1 == 0.5 && o.beta2 == 0.999);
        assert_true(o.eps == 1e-8 && o.clip == preset && o.explode == 1e6 && o.dropout == 1);
        assert_true(o.seed == 1);
        for (int net = 0; net < GGN_NETS; net++) {
            assert_true(o.lr[net] == 2e-4);
            assert_int_equal(o.init[net], preset ? GGN_INIT_HE : net == GGN_NET_D ? GGN_INIT_GAN : GGN_INIT_PAPER);
        }
    }
    (void)state;
}

/* A ramp of a fiftieth of the steps, twenty at least, times half a cosine from 1 to a fiftieth; a half for each divergence. */
static void learning_rates(void **state)
{
    static const double steps[] = {0, 10, 1000, 5000};

    for (int k = 0; k < 4; k++)
        for (double step = 0; step <= steps[k]; step += steps[k] / 10 + (steps[k] == 0)) {
            struct ggn_session s = {.progress.divergences = k};
            double t = steps[k] > 0 ? floor(step) / steps[k] : 0,
                   ramp = fmin(1, (floor(step) + 1) / fmax(20, steps[k] / 50));
            double want = 3 * ramp * (0.02 + 0.98 * (0.5 + 0.5 * cos(3.141592653589793 * t))) / pow(2, k);
            double got = ggn_session_lr(&s, 3, (uint64_t)step, (uint64_t)steps[k]);
            if (!(fabs(got - want) <= 1e-12))
                fail_msg("step %g of %g: %.15g, not %.15g", step, steps[k], got, want);
        }
    (void)state;
}

static void learning_curves(void **state)
{
    char path[] = "/tmp/ggn_curves.XXXXXX", *text;
    struct ggn_log log = {0};
    struct base_err err = {0};
    size_t size;

    assert_true(close(mkstemp(path)) == 0);
    for (int i = 0; i < 9; i++) {
        struct ggn_log_row r = {.phase = i > 6,
                                .step = 10 * i,
                                .loss = 1.0 / (i + 1),
                                .accuracy = (double)NAN,
                                .validation_loss = i + 0.5,
                                .validation_accuracy = 0.25,
                                .validation_auc = 0.75,
                                .lr = 1e-3,
                                .seconds = 0.06 * i,
                                .processor_s = 0.5 * i};
        *(i % 3 ? &r.validation_auc : &r.lr) = (double)NAN;
        assert_int_equal(ggn_log_add(&log, &r, &err), 0);
    }
    assert_int_equal(ggn_log_write_csv(&log, path, &err), 0);
    assert_int_equal(base_file_read(path, 1 << 16, &text, &size, &err), 0);
    assert_string_equal(text,
                        "phase,step,loss,accuracy,validation_loss,validation_accuracy,validation_auc,learning_rate,seconds,"
                        "processor_s\n"
                        "denoiser,0,1,,0.5,0.25,0.75,,0.0,0.0\n"
                        "denoiser,10,0.5,,1.5,0.25,,0.001,0.1,0.5\n"
                        "denoiser,20,0.333333333,,2.5,0.25,,0.001,0.1,1.0\n"
                        "denoiser,30,0.25,,3.5,0.25,0.75,,0.2,1.5\n"
                        "denoiser,40,0.2,,4.5,0.25,,0.001,0.2,2.0\n"
                        "denoiser,50,0.166666667,,5.5,0.25,,0.001,0.3,2.5\n"
                        "denoiser,60,0.142857143,,6.5,0.25,0.75,,0.4,3.0\n"
                        "judge,70,0.125,,7.5,0.25,,0.001,0.4,3.5\n"
                        "judge,80,0.111111111,,8.5,0.25,,0.001,0.5,4.0\n");
    free(text);
    ggn_log_release(&log);
    assert_true(log.n == 0 && !log.rows);
    unlink(path);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(folding_keeps_the_function),
        cmocka_unit_test(the_denoiser_begins_near_its_input),
        cmocka_unit_test(default_plans),
        cmocka_unit_test(learning_rates),
        cmocka_unit_test(learning_curves),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
