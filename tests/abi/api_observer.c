/*
 * The criterion "observer" on pictures whose truth and noise are known: the law of the noise, texture against noise, and
 * what a stopping
 * rule is prone to get wrong (rare bright pixels, black, constant and saturated blocks, small ones, halves that are none).
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <lull/loader.h>

#include "support/api_folders.h"
#include "support/splitmix.h"

enum { SIDE = 200, PIXELS = SIDE * SIDE };

struct picture {
    int w, h;
    uint64_t spp, half_spp;
    double color[PIXELS][3], half[PIXELS][3];
};

static uint64_t state;
static char criteria[2048];

/* grey + texture * +-1 per pixel, with Gaussian noise of sigma per sample; half_spp of the spp samples are in the half. */
static void make(struct picture *p, uint64_t spp, uint64_t half_spp, double grey, double texture, double sigma,
                 uint64_t seed)
{
    double n = (double)spp, h = (double)half_spp;
    state = 99;
    for (int i = 0; i < p->w * p->h; i++)
        p->color[i][0] = grey + (splitmix_uniform(&state) < 0.5 ? -texture : texture); /* the same picture for every seed */
    state = seed * 1000;
    for (int i = 0; i < p->w * p->h; i++) {
        double truth = p->color[i][0], a = truth + sigma / sqrt(h) * splitmix_gauss(&state),
               b = truth + sigma / sqrt(n - h) * splitmix_gauss(&state);
        for (int c = 0; c < 3; c++) {
            p->half[i][c] = a;
            p->color[i][c] = (h * a + (n - h) * b) / n;
        }
    }
    p->spp = spp;
    p->half_spp = half_spp;
}

static int warnings;
static char warning[256];

static void log_line(const struct lull_host *host, int32_t level, const char *text)
{
    (void)host, (void)level;
    warnings++;
    snprintf(warning, sizeof warning, "%s", text);
}

struct setting {
    const char *visible;
    double exposure;
    int32_t transfer;
};
static const struct setting usual = {"0.25", 1, LULL_TRANSFER_SRGB};

/* Asks twice: the second answer must be the first. */
static struct lull_decision ask(const struct picture *p, struct setting set)
{
    static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1, .log = log_line};
    const char *dirs[] = {criteria};
    struct lull_search search = {.dirs = dirs, .dir_count = 1};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;
    struct lull_pair pair = {"visible", set.visible};
    if (lull_open(&search, "observer", &found, &err) != LULL_OK ||
        found.criterion->create(&host, &pair, 1, sizeof pair, &in, &err) != LULL_OK)
        fail_msg("%s", err.message);
    struct lull_rect rect = {0, 0, p->w, p->h};
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .width = (uint32_t)p->w,
                               .height = (uint32_t)p->h,
                               .blocks = &rect,
                               .block_count = 1,
                               .block_stride = sizeof rect,
                               .planes = 0xff,
                               .exposure = set.exposure,
                               .transfer = set.transfer,
                               .gamma = 2.2,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
    assert_int_equal(found.criterion->begin_frame(in, &frame, &err), LULL_OK);
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {p->color, 24, 24 * p->w, 8, 1, LULL_TYPE_F64, LULL_NORM_ONE, 3, 0},
        [LULL_PLANE_HALF] = {p->half, 24, 24 * p->w, 8, 1, LULL_TYPE_F64, LULL_NORM_ONE, 3, 0},
    };
    struct lull_block block = {.x1 = p->w, .y1 = p->h, .spp = p->spp, .half_spp = p->half_spp, .thread_s = (double)NAN};
    struct lull_view view = {.struct_size = sizeof view,
                             .x1 = p->w,
                             .y1 = p->h,
                             .planes = planes,
                             .plane_count = LULL_PLANE_COUNT,
                             .plane_stride = sizeof planes[0],
                             .elapsed_s = (double)NAN};
    struct lull_decision d[2];
    for (int i = 0; i < 2; i++) {
        d[i] = (struct lull_decision){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
        if (found.criterion->evaluate(in, &view, &block, sizeof block, &d[i], sizeof d[i], 1, &err) != LULL_OK)
            fail_msg("%s", err.message);
    }
    assert_memory_equal(&d[0], &d[1], sizeof d[0]);
    found.criterion->destroy(in);
    return d[0];
}

static struct picture *picture_new(int w, int h)
{
    struct picture *p = calloc(1, sizeof *p);
    assert_non_null(p);
    p->w = w;
    p->h = h;
    return p;
}

#define assert_within(value, expected, share) \
    do { \
        double got_ = (value), want_ = (expected); \
        if (!(fabs(got_ - want_) <= (share)*fabs(want_))) \
            fail_msg("%s = %g, expected %g within %g %%", #value, got_, want_, 100 * (share)); \
    } while (0)

/* --- tests ----------------------------------------------------------------------------------------------------------- */

static void law_of_the_noise(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    double first = 0, stop = 0;
    int stopped = 0;
    for (uint64_t n = 64; n <= 16384; n *= 2) {
        make(p, n, n / 2, 0.4, 0, 0.4, n);
        struct lull_decision d = ask(p, usual);
        if (n == 64)
            first = d.error;
        /* noise scatters a little into the texture of a smooth block, far above the limit only */
        assert_within(d.error, first * sqrt(64.0 / (double)n), n < 1024 ? 0.08 : 0.12);
        assert_true(d.p_noisy >= 0 && d.p_noisy <= 1);
        assert_true((d.action == LULL_STOP) == (d.p_noisy <= 0.25));
        if (d.action == LULL_CONTINUE) {
            stop = d.predicted_spp;
            assert_true(d.next_spp > n && (double)d.next_spp <= 1.5 * (double)n + 1);
        } else if (!stopped) {
            assert_true(stop > 0.4 * (double)n && stop < 1.1 * (double)n); /* predicted one doubling before */
            stopped = 1;
        }
    }
    assert_true(stopped);
    free(p);
}

static void texture_hides_and_noise_does_not(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    make(p, 256, 128, 0.4, 0, 0.4, 1);
    double smooth = ask(p, usual).error;
    make(p, 256, 128, 0.4, 0, 0.8, 1);
    double louder = ask(p, usual).error;
    make(p, 256, 128, 0.4, 0.1, 0.4, 1);
    double textured = ask(p, usual).error;
    assert_within(louder, 2 * smooth, 0.1); /* its own noise taken for texture, it would be 1.4 times */
    assert_true(textured < 0.6 * smooth);
    free(p);
}

static void bright_pixels_count(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    make(p, 4096, 2048, 0.4, 0, 0.2, 1);
    assert_int_equal(ask(p, usual).action, LULL_STOP);
    for (int i = 7777; i < 37777; i += 10000) /* three pixels, each by one bright sample in the half */
        for (int c = 0; c < 3; c++) {
            p->half[i][c] += 4;
            p->color[i][c] += 2;
        }
    struct lull_decision d = ask(p, usual);
    assert_int_equal(d.action, LULL_CONTINUE);
    assert_true(d.error > 1.2);
    free(p);
}

static void without_noise(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    static const double greys[] = {0, 0.5, 1, 30};
    for (size_t i = 0; i < sizeof greys / sizeof greys[0]; i++) {
        make(p, 32, 16, greys[i], 0, 0, 1);
        struct lull_decision d = ask(p, usual);
        assert_true(d.action == LULL_STOP && d.error == 0 && d.p_noisy == 0 && d.flags == 0);
    }
    make(p, 32, 16, 30, 0, 1, 1); /* noise that the display cuts off */
    assert_true(ask(p, usual).action == LULL_STOP);
    make(p, 8, 4, 0, 0, 0, 1);
    struct lull_decision d = ask(p, usual);
    assert_true(d.action == LULL_CONTINUE && (d.flags & LULL_DECISION_TOO_EARLY) && d.next_spp == 16);
    free(p);
}

static void halves_that_are_none(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    make(p, 256, 128, 0.4, 0.05, 0.1, 1);
    memcpy(p->half, p->color, sizeof p->half);
    warnings = 0;
    struct lull_decision d = ask(p, usual);
    assert_true(d.action == LULL_CONTINUE && (d.flags & LULL_DECISION_BAD_INPUT) && isnan(d.error));
    assert_int_equal(warnings, 1); /* it was asked twice */
    assert_non_null(strstr(warning, "COLOR and HALF are the same"));
    static const uint64_t bad[] = {0, 256, 300};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        p->half_spp = bad[i];
        warnings = 0;
        d = ask(p, usual);
        assert_true(d.action == LULL_CONTINUE && (d.flags & LULL_DECISION_TOO_EARLY));
        assert_int_equal(warnings, 1);
    }
    free(p);
}

static void broken_pixels(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    make(p, 256, 128, 0.4, 0, 0.4, 1);
    double error = ask(p, usual).error;
    for (int i = 0; i < PIXELS; i += 97)
        p->color[i][1] = i % 2 ? (double)NAN : (double)INFINITY;
    struct lull_decision d = ask(p, usual);
    assert_true(d.flags & LULL_DECISION_BAD_INPUT);
    assert_within(d.error, error, 0.03);
    free(p);
}

static void sizes(void **unused)
{
    (void)unused;
    static const int side[][2] = {{1, 1}, {3, 2}, {1, 200}, {7, 40}, {64, 64}, {200, 117}};
    struct picture *whole = picture_new(SIDE, SIDE);
    make(whole, 256, 128, 0.4, 0, 0.4, 1);
    double error = ask(whole, usual).error;
    for (size_t i = 0; i < sizeof side / sizeof side[0]; i++) {
        struct picture *p = picture_new(side[i][0], side[i][1]);
        double sum = 0, least = 1e9, pixels = side[i][0] * side[i][1];
        for (uint64_t seed = 1; seed <= 20; seed++) {
            make(p, 256, 128, 0.4, 0, 0.4, seed);
            double e = ask(p, usual).error;
            sum += e / 20;
            least = fmin(least, e);
        }
        double narrow = side[i][0] == 1 || side[i][1] == 1 ? 2 : 1; /* there is less to blur over */
        assert_true(pixels < 200 || least > 0.95 * error);          /* one standard error is added: luck stops no block */
        assert_true(sum > 0.9 * error &&
                    sum < narrow * (1 + 5 / sqrt(pixels)) * error); /* few pixels err towards more samples */
        free(p);
    }
    free(whole);
}

static void unequal_halves(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    make(p, 256, 128, 0.4, 0.02, 0.3, 1);
    double error = ask(p, usual).error;
    make(p, 257, 129, 0.4, 0.02, 0.3, 2);
    assert_within(ask(p, usual).error, error, 0.03);
    make(p, 256, 64, 0.4, 0.02, 0.3, 3);
    assert_within(ask(p, usual).error, error, 0.06);
    free(p);
}

static void display(void **unused)
{
    (void)unused;
    struct picture *p = picture_new(SIDE, SIDE);
    struct setting set = usual;
    make(p, 256, 128, 0.4, 0.02, 0.3, 1);
    double error = ask(p, set).error;
    make(p, 256, 128, 0.1, 0.005, 0.075, 1);
    set.exposure = 4;
    assert_within(ask(p, set).error, error, 1e-6);
    set.transfer = LULL_TRANSFER_GAMMA; /* 2.2 is nearly the sRGB curve */
    assert_within(ask(p, set).error, error, 0.05);
    set.transfer = LULL_TRANSFER_LINEAR; /* a picture of codes 0.4: darker, steeper */
    assert_true(fabs(ask(p, set).error - error) > 0.1 * error);
    free(p);
}

static void share_of_viewers(void **unused)
{
    (void)unused;
    static const char *const shares[] = {"0.7", "0.5", "0.25", "0.1", "0.01"};
    struct picture *p = picture_new(SIDE, SIDE);
    double last = 0;
    make(p, 256, 128, 0.4, 0.02, 0.5, 1);
    for (size_t i = 0; i < sizeof shares / sizeof shares[0]; i++) {
        struct setting set = usual;
        set.visible = shares[i];
        struct lull_decision d = ask(p, set);
        assert_true(d.action == LULL_CONTINUE && d.predicted_spp > last); /* fewer who may see it: more samples */
        if (i == 1)
            assert_within(d.predicted_spp, 256 * d.error * d.error, 1e-6); /* half of them: an error of 1 */
        last = d.predicted_spp;
    }
    free(p);
}

int main(void)
{
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(law_of_the_noise),
        cmocka_unit_test(texture_hides_and_noise_does_not),
        cmocka_unit_test(bright_pixels_count),
        cmocka_unit_test(without_noise),
        cmocka_unit_test(halves_that_are_none),
        cmocka_unit_test(broken_pixels),
        cmocka_unit_test(sizes),
        cmocka_unit_test(unequal_halves),
        cmocka_unit_test(display),
        cmocka_unit_test(share_of_viewers),
    };
    return cmocka_run_group_tests_name("observer_criterion", tests, NULL, NULL);
}
