/* The criterion observer against visibility asked directly: its answers with half buffers and without, and fireflies. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <string.h>
#include <lull/criterion.h>

#include "base/colour.h"
#include "nn/hash.h"
#include "sight/observer.h"
#include "sight/visibility.h"
#include "plugin/criteria.h"
#include "plugin/windowed.h"
#include "support/ggn_plugin_host.h"

enum { VALUES = 3 * 24 * 30 };

/* Error of the block whose two pictures of light, [3][P] each, differ by noise of 2 / split times the mean's. */
static double error_by_hand(const struct lull_rect *r, float light[2][VALUES], double split)
{
    const int w = r->x1 - r->x0, height = r->y1 - r->y0, pixels = w * height;
    static float l[2][VALUES];
    static double scratch[5 * 64];
    double texture; /* the block is one patch */

    for (int side = 0; side < 2; side++)
        ggn_visible_lightness(light[side], (size_t)pixels, l[side]);
    ggn_visible_texture(l[0], l[1], w, height, scratch, &texture);
    for (int i = 0; i < pixels; i++)
        l[0][i] = (float)split * (l[0][i] - l[1][i]);
    return (1 + 1.94 / sqrt(pixels)) * ggn_visible_noise(l[0], w, height, &texture, scratch, NULL) /
           ggn_observer_default.level;
}

/* Every answer of the observer by the formulas of its header, for halves that are unequal. */
static void answers_of_the_observer(void **state)
{
    static const struct ggn_display displays[] = {
        {GGN_TRANSFER_SRGB, 2.2, 1}, {GGN_TRANSFER_GAMMA, 1.8, 2}, {GGN_TRANSFER_LINEAR, 2.2, 0.5}};
    const struct lull_criterion *c = &ggn_plugin_observer;
    const double stop = ggn_observer_error_at(&ggn_observer_default, GGN_OBSERVER_VISIBLE);
    int stopped = 0, went_on = 0;
    (void)state;

    for (int k = 0; k < 3; k++) {
        const struct lull_frame frame = gp_host_frame(0xff, &displays[k], 0);
        struct lull_instance *in = gp_host_create(c, NULL, NULL, NULL);
        assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
        for (uint64_t spp = 16; spp <= 4096; spp *= 16) {
            struct lull_decision d[GP_HOST_BLOCKS];
            const double n = (double)spp, h = floor(n * 3 / 8);
            gp_host_render(spp);
            assert_int_equal(gp_host_evaluate(c, in, spp, 7, d), LULL_OK);
            for (int id = 0; id < GP_HOST_BLOCKS; id++) {
                const struct lull_rect *r = &gp_host_rects[id];
                const int w = r->x1 - r->x0, height = r->y1 - r->y0, pixels = w * height;
                static float light[2][VALUES];
                for (int i = 0; i < 3 * pixels; i++) {
                    const int y = r->y0 + i % pixels / w, x = r->x0 + i % w;
                    double a = (double)gp_host_half[y][x][i / pixels],
                           b = (n * (double)gp_host_color[y][x][i / pixels] - h * a) / (n - h);
                    for (int side = 0; side < 2; side++) {
                        double v = fmin(fmax(displays[k].exposure * (side ? b : a), 0), 1);
                        v = k == 1 ? pow(v, 1 / 1.8) : v;
                        light[side][i] = (float)(k ? base_srgb_eotf(v) : v);
                    }
                }
                const double error = error_by_hand(r, light, sqrt(h * (n - h)) / n);
                assert_true(fabs(d[id].error / error - 1) < 1e-6 && d[id].flags == 0);
                assert_true(fabs(d[id].p_noisy - 0.5 * erfc(-2 * log2(error) / (ggn_observer_default.spread * sqrt(2)))) <
                            1e-6);
                assert_int_equal(d[id].action, error <= stop ? LULL_STOP : LULL_CONTINUE);
                double predicted = error <= stop ? n : n * (error / stop) * (error / stop);
                assert_true(fabs(d[id].predicted_spp / predicted - 1) < 1e-5);
                if (error > stop)
                    assert_true(d[id].next_spp == (uint64_t)ceil(fmin(fmax(d[id].predicted_spp, 1.04 * n), 1.5 * n)));
                stopped += error <= stop;
                went_on += error > stop;
            }
        }
        c->end_frame(in);
        c->end_frame(in);
        c->destroy(in);
    }
    assert_true(stopped > 3 && went_on > 3);
    c->destroy(NULL);
    c->end_frame(NULL);
}

/* Without HALF: each answer from the mean and the look that the header of plugin/means.h names, asked twice, and after a call
 * that failed. */
static void answers_from_means(void **state)
{
    static const uint64_t spp[] = {8, 16, 24, 40, 100, 101, 4096}, base[] = {0, 0, 16, 16, 40, 40, 100};
    enum { COUNT = sizeof spp / sizeof spp[0] };
    static float looks[COUNT][GP_HOST_HEIGHT][GP_HOST_WIDTH][3], light[2][VALUES];
    const struct lull_criterion *c = &ggn_plugin_observer;
    const struct lull_frame frame = gp_host_frame(LULL_PLANE_BIT(LULL_PLANE_COLOR), &gp_host_usual, 0);
    struct lull_instance *in = gp_host_create(c, NULL, NULL, NULL);
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    for (int k = 0; k < COUNT; k++) {
        struct lull_decision d[GP_HOST_BLOCKS], again[GP_HOST_BLOCKS];
        int of = 0;
        gp_host_render(spp[k]);
        memcpy(looks[k], gp_host_color, sizeof gp_host_color);
        while (spp[of] < base[k])
            of++;
        assert_int_equal(gp_host_evaluate(c, in, UINT64_MAX, 7, d), LULL_E_INVALID);
        assert_int_equal(gp_host_evaluate(c, in, spp[k], 7, d), LULL_OK);
        assert_int_equal(gp_host_evaluate(c, in, spp[k], 7, again), LULL_OK);
        assert_memory_equal(d, again, sizeof d);
        for (int id = 0; id < GP_HOST_BLOCKS; id++) {
            const struct lull_rect *r = &gp_host_rects[id];
            const int w = r->x1 - r->x0, pixels = w * (r->y1 - r->y0);
            const double scale = sqrt((double)base[k] / (double)(spp[k] - base[k]));
            if (!base[k]) {
                assert_true(d[id].action == LULL_CONTINUE && (d[id].flags & LULL_DECISION_TOO_EARLY) && isnan(d[id].error));
                continue;
            }
            for (int i = 0; i < 3 * pixels; i++) {
                const int y = r->y0 + i % pixels / w, x = r->x0 + i % w, ch = i / pixels;
                const double m = (double)gp_host_color[y][x][ch], noise = scale * (m - (double)looks[of][y][x][ch]);
                light[0][i] = (float)fmin(fmax(m + noise, 0), 1);
                light[1][i] = (float)fmin(fmax(m - noise, 0), 1);
            }
            const double error = error_by_hand(r, light, 0.5);
            assert_true(fabs(d[id].error / error - 1) < 1e-5 && d[id].flags == 0);
            assert_int_equal(d[id].action, error <= ggn_observer_error_at(&ggn_observer_default, GGN_OBSERVER_VISIBLE)
                                               ? LULL_STOP
                                               : LULL_CONTINUE);
        }
    }
    c->destroy(in);
}

/* Two pixels that one bright sample each has hit hold a grey block that is at rest without them. */
static void fireflies(void **state)
{
    const struct lull_criterion *c = &ggn_plugin_observer;
    (void)state;

    for (int hot = 0; hot < 2; hot++)
        for (int halves = 0; halves < 2; halves++) {
            const struct lull_frame frame =
                gp_host_frame(halves ? 0xff : LULL_PLANE_BIT(LULL_PLANE_COLOR), &gp_host_usual, 0);
            struct lull_instance *in = gp_host_create(c, NULL, NULL, NULL);
            struct lull_decision d[GP_HOST_BLOCKS];
            assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
            for (uint64_t spp = 256; spp <= 1024; spp *= 4) {
                for (int i = 0; i < GP_HOST_HEIGHT * GP_HOST_WIDTH * 3; i++)
                    (&gp_host_color[0][0][0])[i] = (&gp_host_half[0][0][0])[i] =
                        0.4f + 1e-4f * (float)ggn_hash_unit((uint32_t)i, (uint32_t)spp);
                for (int ch = 0; ch < 3 && hot && spp == 1024; ch++) {
                    gp_host_color[8][9][ch] += 300.0f / 1024;
                    gp_host_half[8][9][ch] += 300.0f / 384;
                    gp_host_color[12][15][ch] += 300.0f / 1024;
                }
                gp_host_half[5][5][0] += 1e-4f;
                assert_int_equal(gp_host_evaluate(c, in, spp, 1, d), LULL_OK);
            }
            assert_int_equal(d[0].action, hot ? LULL_CONTINUE : LULL_STOP);
            c->destroy(in);
        }
}

/* fps, ppd: the same noise, less or more visible by what its bands say; 0 and 67 are a still as usual. */
static void pictures_as_they_are_viewed(void **state)
{
    static const char *const fps[] = {NULL, "0", "24", "60", "24", NULL, NULL, NULL};
    static const char *const ppd[] = {NULL, NULL, NULL, NULL, "20", "67", "134", "40"};
    enum { COUNT = sizeof fps / sizeof fps[0] };
    const struct lull_criterion *c = &ggn_plugin_observer;
    struct lull_decision d[COUNT][GP_HOST_BLOCKS];
    (void)state;

    for (int halves = 0; halves < 2; halves++) {
        const struct lull_frame frame = gp_host_frame(halves ? 0xff : LULL_PLANE_BIT(LULL_PLANE_COLOR), &gp_host_usual, 0);
        for (int k = 0; k < COUNT; k++) {
            const struct lull_pair pairs[] = {{fps[k] ? "fps" : "ppd", fps[k] ? fps[k] : ppd[k]}, {"ppd", ppd[k]}};
            struct lull_instance *in = NULL;
            assert_int_equal(c->create(NULL, pairs, (uint32_t)(!!fps[k] + !!ppd[k]), sizeof *pairs, &in, NULL), LULL_OK);
            assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
            for (uint64_t spp = 16; spp <= 64; spp *= 4) {
                gp_host_render(spp);
                assert_int_equal(gp_host_evaluate(c, in, spp, 7, d[k]), LULL_OK);
            }
            c->destroy(in);
        }
        assert_memory_equal(d[0], d[1], sizeof d[0]);
        for (int id = 0; id < GP_HOST_BLOCKS; id++) {
            const double still = d[0][id].error;
            assert_true(d[2][id].error > 0.55 * still && d[2][id].error < 0.8 * still);
            assert_true(d[3][id].error < 0.8 * d[2][id].error);
            assert_true(d[4][id].error > d[2][id].error); /* the same pixels are coarser to the eye */
            assert_true(d[5][id].error == still && d[6][id].error < 0.65 * still && d[7][id].error > still);
            assert_true(d[2][id].p_noisy <= d[0][id].p_noisy && d[2][id].predicted_spp <= d[0][id].predicted_spp);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(answers_of_the_observer),
        cmocka_unit_test(answers_from_means),
        cmocka_unit_test(fireflies),
        cmocka_unit_test(pictures_as_they_are_viewed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
