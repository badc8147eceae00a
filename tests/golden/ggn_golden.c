/* The golden values of the design (double 1e-6, float 1e-4 relative) and one published training iteration, whose figures
 * were checked against PyTorch 1.13 in double precision (scripts/lab networks --check). */
#include "support/ggn_cmocka.h"

#include <math.h>

#include "support/ggn_golden.h"

static const double DOUBLE_TOLERANCE = 1e-6, FLOAT_TOLERANCE = 1e-4;

static double tolerance;

static void near(const char *what, double got, double want)
{
    double error = fabs(got - want) / fmax(fabs(want), 1e-2);

    if (!(error <= tolerance))
        fail_msg("%s = %.12g, expected %.12g (relative %.2g)", what, got, want, error);
}

static void check_values(const struct ggn_golden *g)
{
    static const struct {
        const char *name;
        double rms;
    } stage[] = {{"enc0", .556872310},  {"enc1", .830844706},  {"enc2", .788503493},  {"enc3", .985084621},
                 {"enc4", 1.004145069}, {"dec0", 1.213926126}, {"dec1", .721034384},  {"dec2", .697705386},
                 {"dec3", .465891190},  {"conv1", .702611302}, {"pool1", .529484262}, {"conv2", .725524097},
                 {"pool2", .617077407}, {"conv3", .611682443}, {"pool3", .732168326}, {"fc1", .993858154},
                 {"fc2", .986990673},   {"fc3", 1.103226966}};
    static const double p[4] = {.786932669062, .773263945936, .773324065289, .783187939314};
    static const double ssim[4] = {.090206966, .339405721, .648177038, .276608930};

    near("x_first", g->x_first, .789805404);
    near("x_last", g->x_last, .233435633);
    near("x_mean", g->x_mean, .498297412);
    near("denoiser mean", g->denoiser_mean, .414047007);
    near("denoiser std", g->denoiser_std, .202687377);
    near("denoiser (0,0)", g->denoiser_at[0], .475838064);
    near("denoiser (100,100)", g->denoiser_at[1], .721308978);
    near("denoiser (199,199)", g->denoiser_at[2], .534454958);
    near("generator noisy mean", g->generator_noisy_mean, .497957284);
    near("generator noisy std", g->generator_noisy_std, .079715208);
    near("generator noisy (0,0)", g->generator_noisy_at[0], .511499948);
    near("generator noisy (100,100)", g->generator_noisy_at[1], .516105319);
    near("generator noisy (199,199)", g->generator_noisy_at[2], .429059772);
    near("generator denoised mean", g->generator_denoised_mean, .466829226);
    near("generator denoised std", g->generator_denoised_std, .034428853);
    near("generator denoised (0,0)", g->generator_denoised_at, .530449406);
    assert_int_equal(g->n_stages, 18);
    for (int i = 0; i < 18; i++) {
        assert_string_equal(g->stage[i].name, stage[i].name);
        near(stage[i].name, g->stage[i].rms, stage[i].rms);
    }
    near("logit", g->logit[0], 1.306534467);
    for (int i = 0; i < 4; i++) {
        near("p", g->p[i], p[i]);
        near("ssim", g->ssim[i], ssim[i]);
    }
}

static void run(int single, int train_step, struct ggn_golden *g)
{
    static const struct ggn_golden_seeds seeds = {{100, 300, 500}};
    struct base_err err = {0};
    struct base_threads *threads = base_threads_create(2, &err);

    if ((single ? ggn_golden_run : ggn_golden_run_f64)(&seeds, train_step, threads, g, &err))
        fail_msg("%s", err.text);
    base_threads_destroy(threads);
}

static void test_double(void **state)
{
    static const double loss[6] = {0.809551860298, 0.641433609298, 0.539072436747,
                                   0.451018026472, 0.373216579153, 0.316327256502};
    static const double before[4] = {0.919448282118, 0.533631415128, 0.437554262785, 0.497948811965};
    static const double after[4] = {0.948373972558, 0.440280053944, 0.480566945338, 0.490151559571};
    struct ggn_golden g;

    run(0, 1, &g);
    tolerance = DOUBLE_TOLERANCE;
    check_values(&g);
    for (int i = 0; i < 6; i++)
        near("denoiser loss", g.train.step.denoiser_loss[i], loss[i]);
    for (int i = 0; i < 4; i++) {
        near("D before", g.train.d_prob_before[i], before[i]);
        near("D after", g.train.d_prob_after[i], after[i]);
    }
    near("denoiser gradient", g.train.step.denoiser_grad_l2, 2.04341175370);
    near("bce before", g.train.step.bce_before, 0.590592058240);
    near("D gradient", g.train.step.d_grad_l2, 40.3696517922);
    near("bce after", g.train.step.bce_after, 0.509938898595);
    near("M gradient, accumulated", g.train.step.m_grad_l2_accumulated, 341.842505784);
    near("sum of R", g.train.sum_params[0], 724.997300348);
    near("sum of M", g.train.sum_params[1], 985.666488556);
    near("sum of D", g.train.sum_params[2], 851.216414449);
    near("means of R", g.train.sum_running_mean[0], 171.470035762);
    near("means of M", g.train.sum_running_mean[1], 93.8468325686);
    near("means of D", g.train.sum_running_mean[2], -5.63603665507);
    near("variances of R", g.train.sum_running_var[0], 639.616982133);
    near("variances of M", g.train.sum_running_var[1], 865.409915497);
    near("variances of D", g.train.sum_running_var[2], 877.742340805);
    (void)state;
}

static void test_float(void **state)
{
    struct ggn_golden g;

    run(1, 0, &g);
    tolerance = FLOAT_TOLERANCE;
    check_values(&g);
    (void)state;
}

/* Parameter and MAC counts of the paper's Table 1. */
static void test_sizes(void **state)
{
    static const size_t params[GGN_NETS] = {1376307, 1539901, 675649};
    static const double mac[GGN_NETS] = {1578694656, 1143699200, 18901056};
    struct ggn_hyper hyper = ggn_hyper_default(GGN_PRESET_PAPER);
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        assert_int_equal(ggn_network_build(&g, net, &hyper, NULL), 0);
        assert_int_equal(g.n_params, params[net]);
        assert_true(ggn_graph_mac(&g) == mac[net]);
    }
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_sizes), cmocka_unit_test(test_double),
                                       cmocka_unit_test(test_float)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
