/*
 * Residual models: what is measured of a block, the stopping rule that begins with it, and the criterion "ggn" with an
 * untrained one, which decides as `observer` does at the same looks, with half buffers and without.
 */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <lull/criterion.h>

#include "model/inference.h"
#include "sight/measure.h"
#include "model/stopper.h"
#include "model/trainer.h"
#include "sight/visibility.h"
#include "nn/hash.h"
#include "sight/observer.h"
#include "plugin/criteria.h"

enum { WIDTH = 64, HEIGHT = 48, BLOCKS = 2, WINDOW = 3, LOOKS = 40 };
static const struct lull_rect rects[BLOCKS] = {{0, 0, 40, 48}, {40, 0, 64, 48}};
static const struct ggn_hyper hyper = {GGN_PRESET_LULL, 48, 40, WINDOW, 3, 4, 3, 1, 0.5, GGN_SCALARS};

static char path[] = "/tmp/ggn_residual.XXXXXX";
static float color[HEIGHT][WIDTH][3], half[HEIGHT][WIDTH][3];

/* The weights that training begins with: its last layer is zero. last: what to put there. */
static void write_model(float last)
{
    struct ggn_train_options options = ggn_train_options_default(GGN_PRESET_LULL);
    struct ggn_model *m = ggn_model_create(&hyper, NULL);
    struct ggn_policy p = ggn_policy_default();
    options.batch = 2;
    struct ggn_trainer *t = ggn_trainer_create(&hyper, &options, NULL, NULL);

    assert_true(m && t);
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_copy(m->weights[net], t->weights[net]->params);
    const struct ggn_graph *d = &m->graph[GGN_NET_D];
    const struct ggn_tensor *bias = &d->tensor[d->n_tensors - 1];
    for (size_t i = d->tensor[d->n_tensors - 2].offset; i < d->n_params; i++)
        assert_true(m->weights[GGN_NET_D]->params[i] == 0);
    m->weights[GGN_NET_D]->params[bias->offset] = last;
    p.first_spp = 16;
    p.ratio = 1.25;
    p.scale = ggn_observer_slope(&ggn_observer_default);
    p.threshold = GGN_OBSERVER_VISIBLE;
    p.passes = 1;
    assert_int_equal(ggn_policy_set(m, &p, NULL), 0);
    assert_int_equal(ggn_model_save(m, path, GGN_F32, NULL), 0);
    ggn_trainer_destroy(t);
    ggn_model_destroy(m);
}

static int setup(void **state)
{
    int fd = mkstemp(path);

    (void)state;
    return fd < 0 ? -1 : close(fd);
}

static int teardown(void **state)
{
    (void)state;
    return unlink(path);
}

/* Sums of independent samples: their running mean and that of every second one, up to spp. */
static void render(uint64_t spp)
{
    static double all[HEIGHT * WIDTH * 3], even[HEIGHT * WIDTH * 3];
    static uint64_t taken;

    if (spp < taken) {
        taken = 0;
        memset(all, 0, sizeof all);
        memset(even, 0, sizeof even);
    }
    for (; taken < spp; taken++)
        for (uint32_t i = 0; i < HEIGHT * WIDTH * 3; i++) {
            const uint32_t x = i / 3 % WIDTH, y = i / 3 / WIDTH;
            const double strong = x < 40 ? 0.5 : 1.2, clean = 0.3 + 0.1 * sin(0.3 * x) * sin(0.2 * y);
            const double sample = clean * (1 + strong * (2 * ggn_hash_unit(i, (uint32_t)taken + 7) - 1));
            all[i] += sample;
            even[i] += taken % 2 ? 0 : sample;
        }
    for (uint32_t i = 0; i < HEIGHT * WIDTH * 3; i++) {
        color[i / 3 / WIDTH][i / 3 % WIDTH][i % 3] = (float)(all[i] / (double)spp);
        half[i / 3 / WIDTH][i / 3 % WIDTH][i % 3] = (float)(even[i] / (double)((spp + 1) / 2));
    }
}

static struct lull_instance *begin(const struct lull_criterion *c, int halves)
{
    static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1};
    const struct lull_pair pairs[] = {{"model", path}};
    const struct lull_frame frame = {.struct_size = sizeof frame,
                                     .width = WIDTH,
                                     .height = HEIGHT,
                                     .blocks = rects,
                                     .block_count = BLOCKS,
                                     .block_stride = sizeof rects[0],
                                     .planes = halves ? 0xff : 0xff & ~LULL_PLANE_BIT(LULL_PLANE_HALF),
                                     .exposure = 1,
                                     .transfer = LULL_TRANSFER_SRGB,
                                     .gamma = 2.2,
                                     .spp_max = 100000,
                                     .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;

    if (c->create(&host, pairs, c == &ggn_plugin_ggn, sizeof pairs[0], &in, &err) || c->begin_frame(in, &frame, &err))
        fail_msg("%s", err.message);
    return in;
}

/* Both blocks at spp; with_halves as the frame was begun. */
static void look(const struct lull_criterion *c, struct lull_instance *in, uint64_t spp, int halves, struct lull_decision *d)
{
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {color, 12, 12 * WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0}};
    struct lull_block blocks[BLOCKS];
    struct lull_error err = {.struct_size = sizeof err};

    if (halves)
        planes[LULL_PLANE_HALF] = (struct lull_plane){half, 12, 12 * WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0};
    const struct lull_view view = {.struct_size = sizeof view,
                                   .x1 = WIDTH,
                                   .y1 = HEIGHT,
                                   .planes = planes,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .plane_stride = sizeof planes[0],
                                   .elapsed_s = (double)NAN};
    for (uint32_t i = 0; i < BLOCKS; i++) {
        blocks[i] = (struct lull_block){.id = i,
                                        .x0 = rects[i].x0,
                                        .y0 = rects[i].y0,
                                        .x1 = rects[i].x1,
                                        .y1 = rects[i].y1,
                                        .spp = spp,
                                        .half_spp = halves ? (spp + 1) / 2 : 0,
                                        .thread_s = (double)NAN};
        d[i] = (struct lull_decision){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    }
    if (c->evaluate(in, &view, blocks, sizeof blocks[0], d, sizeof d[0], BLOCKS, &err))
        fail_msg("%s", err.message);
}

static uint64_t look_at(int k) { return (uint64_t)(16 * pow(1.17, k)); }

/* --- the criterion ---------------------------------------------------------------------------------------------------- */

static void decides_as_observer(int halves)
{
    struct lull_instance *observer = begin(&ggn_plugin_observer, halves), *ggn = begin(&ggn_plugin_ggn, halves);
    uint64_t stopped[BLOCKS] = {0};
    int judged = 0;

    for (int k = 0; k < LOOKS; k++) {
        struct lull_decision a[BLOCKS], b[BLOCKS];
        render(look_at(k));
        look(&ggn_plugin_observer, observer, look_at(k), halves, a);
        look(&ggn_plugin_ggn, ggn, look_at(k), halves, b);
        for (int i = 0; i < BLOCKS; i++) {
            if (stopped[i])
                continue;
            assert_int_equal(a[i].action, b[i].action);
            assert_int_equal(a[i].flags, b[i].flags);
            if (isnan(a[i].error)) {
                assert_true(isnan(b[i].error) && isnan(b[i].p_noisy));
                continue;
            }
            judged++;
            assert_true(fabs(a[i].error / b[i].error - 1) < 1e-12);
            assert_true(fabs(a[i].p_noisy - b[i].p_noisy) < 0.03); /* a logistic for a normal distribution */
            stopped[i] = a[i].action == LULL_STOP ? look_at(k) : 0;
        }
    }
    assert_true(stopped[0] > 40 && stopped[1] > 2 * stopped[0] && judged > 20);
    ggn_plugin_observer.destroy(observer);
    ggn_plugin_ggn.destroy(ggn);
}

static void an_untrained_network_is_the_observer(void **state)
{
    (void)state;
    write_model(0);
    decides_as_observer(1);
    decides_as_observer(0);
}

/* Where the first block stops with this last bias. */
static uint64_t stop_of(float last)
{
    struct lull_decision d[BLOCKS];
    uint64_t spp = 0;

    write_model(last);
    struct lull_instance *in = begin(&ggn_plugin_ggn, 1);
    for (int k = 0; k < LOOKS && !spp; k++) {
        render(look_at(k));
        look(&ggn_plugin_ggn, in, look_at(k), 1, d);
        spp = d[0].action == LULL_STOP ? look_at(k) : 0;
    }
    ggn_plugin_ggn.destroy(in);
    return spp;
}

static void a_network_moves_the_stop_within_its_reach(void **state)
{
    uint64_t plain = stop_of(0), late = stop_of(100), early = stop_of(-100);

    (void)state;
    /* half an octave of noise is one of samples; looks are 1.17 apart */
    assert_true((double)late > 1.7 * (double)plain && (double)late < 2.4 * (double)plain);
    assert_true((double)early < 0.6 * (double)plain && (double)early > 0.4 * (double)plain);
}

/* --- the rule --------------------------------------------------------------------------------------------------------- */

struct show {
    double law, logit;
    int asked;
};

static double logit(void *data)
{
    ((struct show *)data)->asked++;
    return ((struct show *)data)->logit;
}

static double law(void *data) { return ((struct show *)data)->law; }

static int ask(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp, struct show *show)
{
    const struct ggn_evidence e = {show, logit, law};
    int what = ggn_stopper_ask(rule, s, spp);

    if (what)
        ggn_stopper_decide(rule, s, &e);
    assert_true(ggn_stopper_valid(rule, s));
    return what;
}

static struct ggn_stop_rule residual_rule(void)
{
    struct ggn_stop_rule r = {.policy = ggn_policy_default(), .window = WINDOW, .reach = 0.5};

    r.policy.first_spp = 16;
    r.policy.ratio = 1.25;
    r.policy.scale = 7;
    r.policy.threshold = 0.35;
    r.policy.passes = 1;
    return r;
}

static void the_law_decides_before_and_between_windows(void **state)
{
    const struct ggn_stop_rule rule = residual_rule();
    struct ggn_stopper s = {0};
    struct show show = {.law = 0.8, .logit = 0.1};

    (void)state;
    assert_int_equal(ask(&rule, &s, 10, &show), GGN_LOOK_NONE);
    assert_int_equal(ask(&rule, &s, 16, &show), GGN_LOOK_IMAGE);
    assert_true(!s.verdict.too_early && fabs(s.verdict.p - 1 / (1 + exp(-7 * 0.8))) < 1e-12 && show.asked == 0);
    assert_true(fabs(s.verdict.noise - exp2(0.8)) < 1e-12 && s.verdict.next_spp == 20);
    assert_int_equal(ask(&rule, &s, 18, &show), GGN_LOOK_BETWEEN);
    assert_int_equal(ask(&rule, &s, 20, &show), GGN_LOOK_IMAGE);
    assert_int_equal(ask(&rule, &s, 25, &show), GGN_LOOK_IMAGE);
    assert_int_equal(show.asked, 1);
    const double correction = 0.5 * tanh(0.2);
    assert_true(fabs(s.correction - correction) < 1e-12);
    show.law = 0;
    assert_int_equal(ask(&rule, &s, 27, &show), GGN_LOOK_BETWEEN); /* with the correction of before */
    assert_true(show.asked == 1 && fabs(s.verdict.p - 1 / (1 + exp(-7 * correction))) < 1e-12);
    show.law = -0.15; /* alone it would stop: 7 * -0.15 is below log(0.35/0.65) */
    assert_int_equal(ask(&rule, &s, 28, &show), GGN_LOOK_BETWEEN);
    assert_false(s.verdict.stop);
    show.law = -0.2;
    assert_int_equal(ask(&rule, &s, 29, &show), GGN_LOOK_BETWEEN);
    assert_true(s.verdict.stop && s.verdict.predicted_spp == 29);
    assert_int_equal(ask(&rule, &s, 29, &show), GGN_LOOK_NONE);
}

static void a_network_that_changes_nothing_is_not_asked(void **state)
{
    const struct ggn_stop_rule rule = residual_rule();
    struct ggn_stopper s = {0};
    struct show show = {.law = 3, .logit = (double)NAN};
    uint64_t spp = 16;

    (void)state;
    for (int k = 0; k < 6; k++, spp = s.verdict.next_spp)
        assert_int_equal(ask(&rule, &s, spp, &show), GGN_LOOK_IMAGE);
    assert_int_equal(show.asked, 0);
    show.law = -0.3;
    ask(&rule, &s, spp, &show);
    assert_true(show.asked == 1 && s.correction == 0.5 && !s.verdict.stop); /* no number: all the noise it may see */
    show.law = (double)NAN;
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.too_early && isnan(s.verdict.p) && s.correction == 0 && show.asked == 1);
    s.correction = 0.6;
    assert_false(ggn_stopper_valid(&rule, &s));
}

/* The next look falls where the law expects the end, as that of `observer`, so that cadence costs no samples. */
static void looks_fall_where_the_law_expects_the_end(void **state)
{
    const struct ggn_stop_rule rule = residual_rule();
    struct ggn_stopper s = {0};
    const double stop = log(0.35 / 0.65) / 7;
    struct show show = {.law = stop + 0.04};

    (void)state;
    ask(&rule, &s, 1000, &show);
    assert_int_equal(s.verdict.next_spp, ceil(1000 * exp2(0.08)));
    show.law = stop + 1e-4;
    ask(&rule, &s, 1057, &show);
    assert_int_equal(s.verdict.next_spp, ceil(1057 * 1.04));
}

/* --- what is measured ------------------------------------------------------------------------------------------------- */

static void a_measure_is_the_law_and_what_surrounds_it(void **state)
{
    enum { W = 200, H = 150, P = W * H };
    static uint8_t map[P];
    static float lightness[2][P];
    struct ggn_meter m;
    struct ggn_meter_room room = {0};
    struct ggn_measure got;
    double texture[4], *scratch = malloc(ggn_visibility_scratch(W) * sizeof *scratch), sum = 0;

    (void)state;
    ggn_meter_make_room(&room, W, H);
    assert_int_equal(ggn_meter_init(&m, &room, NULL), 0);
    for (uint32_t p = 0; p < P; p++) {
        double clean = 0.2 + 0.1 * ((p % W / 8 + p / W / 8) & 1), noise[2];
        for (uint32_t k = 0; k < 2; k++) {
            noise[k] = -6;
            for (uint32_t i = 0; i < 12; i++) /* nearly Gaussian */
                noise[k] += ggn_hash_unit(p, 12 * k + i);
        }
        for (uint32_t k = 0; k < 2; k++)
            for (uint32_t c = 0; c < 3; c++)
                m.rgb[k][c * P + p] = (float)(clean + (p % W < W / 2 ? 0.01 : 0.002) * noise[k]);
    }
    ggn_measure(&m, W, H, 0.5, 0, &got, map);
    for (int k = 0; k < 2; k++)
        ggn_visible_lightness(m.rgb[k], P, lightness[k]);
    ggn_visible_texture(lightness[0], lightness[1], W, H, scratch, texture);
    for (int p = 0; p < P; p++) {
        sum += (double)(lightness[0][p] + lightness[1][p]) / 200 / P;
        lightness[0][p] = 0.5F * (lightness[0][p] - lightness[1][p]);
    }
    assert_true(got.visible == ggn_visible_noise(lightness[0], W, H, texture, scratch, NULL));
    assert_true(fabs(got.lightness - sum) < 1e-9);
    double mean = 0;
    for (int k = 0; k < 4; k++)
        mean += log2(texture[k] + 2) / 4;
    assert_true(fabs(got.texture - mean) < 1e-12);
    assert_true(fabs(got.peak - 0.651) < 0.1 && got.uneven > 0.3 && got.uneven < 0.5); /* sqrt(2) times the squares' mean */
    double highest = 0, quiet = 0;
    for (int p = 0; p < P; p++)
        *(p % W < W / 2 ? &highest : &quiet) += (double)map[p] / (P / 2);
    assert_true(highest / quiet > 3.5);
    ggn_meter_release(&m);
    free(scratch);
}

static void scalars_mean_the_same_in_every_scene(void **state)
{
    struct ggn_measure w[WINDOW] = {{4, 2, 0.5, 0.651, 0}, {2, 2, 0.5, 0.651, 0}, {1.5, 3, 0.25, 1.651, 0.5}};
    const double spp[WINDOW] = {100, 400, 1600};
    float s[GGN_SCALARS];

    (void)state;
    ggn_measure_scalars(w, spp, WINDOW, -0.5, s);
    const double want[GGN_SCALARS] = {-0.5, log2(1.5 / 4) + 2, log2(1.5 / 2) + 1, 1, -0.25, 1, 0.5};
    for (int i = 0; i < GGN_SCALARS; i++)
        assert_true(fabs((double)s[i] - want[i]) < 1e-6);
    w[0].visible = w[1].visible = (double)NAN; /* a host without halves knows nothing of its first looks */
    ggn_measure_scalars(w, spp, WINDOW, 100, s);
    assert_true(s[1] == 0 && s[2] == 0 && s[0] == 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(an_untrained_network_is_the_observer),
                                       cmocka_unit_test(a_network_moves_the_stop_within_its_reach),
                                       cmocka_unit_test(the_law_decides_before_and_between_windows),
                                       cmocka_unit_test(a_network_that_changes_nothing_is_not_asked),
                                       cmocka_unit_test(looks_fall_where_the_law_expects_the_end),
                                       cmocka_unit_test(a_measure_is_the_law_and_what_surrounds_it),
                                       cmocka_unit_test(scalars_mean_the_same_in_every_scene)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
