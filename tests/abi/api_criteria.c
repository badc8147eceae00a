/*
 * What the example criteria answer: their formulas on pictures with known statistics, and the pictures that stopping rules
 * are prone to get wrong (black, constant, a firefly, NaN).
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

enum { W = 200, H = 200, PIXELS = W * H };

/* One block of a picture of 400x400, as sums over its samples. */
struct render {
    double color[PIXELS][3], half[PIXELS][3], moment2[PIXELS];
    uint32_t pixel_spp[PIXELS];
    uint64_t spp, half_spp;
    uint64_t random;
    int with_pixel_spp;
};

/* rgb_to_xyz's second row is (0.25, 0.5, 0.25) below: simple numbers for exact expectations. */
static double luminance(const double rgb[3]) { return 0.25 * rgb[0] + 0.5 * rgb[1] + 0.25 * rgb[2]; }

typedef void (*sample_fn)(struct render *r, int pixel, double rgb[3]);

static void add(struct render *r, sample_fn sample, uint64_t spp)
{
    for (; r->spp < spp; r->spp++) {
        int half = r->spp % 2 == 0;
        for (int i = 0; i < PIXELS; i++) {
            double rgb[3];
            sample(r, i, rgb);
            for (int c = 0; c < 3; c++) {
                r->color[i][c] += rgb[c];
                if (half)
                    r->half[i][c] += rgb[c];
            }
            r->moment2[i] += luminance(rgb) * luminance(rgb);
        }
        r->half_spp += half ? 1 : 0;
    }
}

static void black(struct render *r, int pixel, double rgb[3])
{
    (void)r, (void)pixel;
    rgb[0] = rgb[1] = rgb[2] = 0;
}

static void constant(struct render *r, int pixel, double rgb[3])
{
    (void)r, (void)pixel;
    rgb[0] = rgb[1] = rgb[2] = 0.5;
}

/* 0 or 1 with equal probability: mean 0.5, variance 0.25. */
static void coin(struct render *r, int pixel, double rgb[3])
{
    (void)pixel;
    rgb[0] = rgb[1] = rgb[2] = splitmix_uniform(&r->random) < 0.5;
}

static void firefly_on_black(struct render *r, int pixel, double rgb[3])
{
    (void)pixel;
    rgb[0] = rgb[1] = rgb[2] = splitmix_uniform(&r->random) < 1e-5 ? 1000 : 0;
}

static void firefly_on_grey(struct render *r, int pixel, double rgb[3])
{
    (void)pixel;
    rgb[0] = rgb[1] = rgb[2] = splitmix_uniform(&r->random) < 1e-5 ? 1000 : 0.5;
}

/* --- asking ---------------------------------------------------------------------------------------------------------- */

static char criteria[2048];

struct asked {
    const struct lull_criterion *criterion;
    struct lull_instance *instance;
};

static void begin(struct asked *a, const char *name, const struct lull_pair *pairs, uint32_t count, double exposure)
{
    const char *dirs[] = {criteria};
    struct lull_search search = {.dirs = dirs, .dir_count = 1};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    if (lull_open(&search, name, &found, &err) != LULL_OK)
        fail_msg("%s", err.message);
    a->criterion = found.criterion;
    if (a->criterion->create(NULL, pairs, count, sizeof *pairs, &a->instance, &err) != LULL_OK)
        fail_msg("%s", err.message);
    struct lull_rect rect = {0, 0, W, H};
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .width = 2 * W,
                               .height = 2 * H,
                               .blocks = &rect,
                               .block_count = 1,
                               .block_stride = sizeof rect,
                               .planes = 0xff,
                               .exposure = exposure,
                               .spp_max = 1 << 20,
                               .rgb_to_xyz = {0, 0, 0, 0.25, 0.5, 0.25, 0, 0, 0}};
    assert_int_equal(a->criterion->begin_frame(a->instance, &frame, &err), LULL_OK);
}

static struct lull_decision ask(const struct asked *a, const struct render *r)
{
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {r->color, 24, 24 * W, 8, 1, LULL_TYPE_F64, LULL_NORM_SPP, 3, 0},
        [LULL_PLANE_MOMENT2] = {r->moment2, 8, 8 * W, 8, 1, LULL_TYPE_F64, LULL_NORM_SPP, 1, 0},
        [LULL_PLANE_HALF] = {r->half, 24, 24 * W, 8, 1, LULL_TYPE_F64, LULL_NORM_HALF_SPP, 3, 0},
    };
    if (r->with_pixel_spp)
        planes[LULL_PLANE_SPP] = (struct lull_plane){r->pixel_spp, 4, 4 * W, 4, 1, LULL_TYPE_U32, LULL_NORM_ONE, 1, 0};
    struct lull_block block = {.x1 = W, .y1 = H, .spp = r->spp, .half_spp = r->half_spp, .thread_s = (double)NAN};
    struct lull_view view = {.struct_size = sizeof view,
                             .x1 = W,
                             .y1 = H,
                             .planes = planes,
                             .plane_count = LULL_PLANE_COUNT,
                             .plane_stride = sizeof planes[0],
                             .elapsed_s = (double)NAN};
    struct lull_decision d = {.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    struct lull_error err = {.struct_size = sizeof err};
    if (a->criterion->evaluate(a->instance, &view, &block, sizeof block, &d, sizeof d, 1, &err) != LULL_OK)
        fail_msg("%s", err.message);
    return d;
}

static struct lull_decision ask_once(const char *name, const struct render *r)
{
    struct asked a;
    begin(&a, name, NULL, 0, 1);
    struct lull_decision d = ask(&a, r);
    a.criterion->destroy(a.instance);
    return d;
}

static struct render *render_new(void)
{
    struct render *r = calloc(1, sizeof *r);
    assert_non_null(r);
    r->random = 1;
    return r;
}

static const char *const judges[] = {"variance", "halfbuf"};

/* --- tests ----------------------------------------------------------------------------------------------------------- */

static void null_never_stops(void **state)
{
    (void)state;
    struct render *r = render_new();
    r->spp = 1 << 30;
    assert_int_equal(ask_once("null", r).action, LULL_CONTINUE);
    free(r);
}

static void fixed_stops_at_its_number(void **state)
{
    (void)state;
    struct asked a;
    struct lull_pair pair = {"spp", "100"};
    struct render *r = render_new();
    begin(&a, "fixed", &pair, 1, 1);
    for (r->spp = 0; r->spp < 100; r->spp += 33) {
        struct lull_decision d = ask(&a, r);
        assert_int_equal(d.action, LULL_CONTINUE);
        assert_int_equal(d.next_spp, 100);
        assert_true(d.predicted_spp == 100);
    }
    r->spp = 100;
    assert_int_equal(ask(&a, r).action, LULL_STOP);
    a.criterion->destroy(a.instance);
    free(r);
}

static void black_and_constant_stop_with_error_0(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            struct render *r = render_new();
            add(r, k ? constant : black, 16);
            struct lull_decision d = ask_once(judges[i], r);
            assert_int_equal(d.action, LULL_STOP);
            assert_int_equal(d.flags, 0);
            assert_true(d.error < 1e-6);
            free(r);
        }
}

static void too_early_is_said(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct render *r = render_new();
        add(r, constant, 15);
        struct lull_decision d = ask_once(judges[i], r);
        assert_int_equal(d.action, LULL_CONTINUE);
        assert_int_equal(d.flags, LULL_DECISION_TOO_EARLY);
        assert_true(d.next_spp >= 16);
        assert_true(isnan(d.error));
        free(r);
    }
}

/* The firefly's contribution to the block's mean error is below either threshold: the tail guard must hold the block. */
static void a_firefly_does_not_stop(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++) {
            struct render *r = render_new();
            add(r, k ? firefly_on_grey : firefly_on_black, 16);
            double most = 0;
            for (int p = 0; p < PIXELS; p++)
                most = fmax(most, r->color[p][0]);
            assert_true(most > 900); /* 640,000 samples: one in 10^5 has come */
            struct lull_decision d = ask_once(judges[i], r);
            assert_int_equal(d.action, LULL_CONTINUE);
            assert_true(isfinite(d.error) && d.error >= 0);

            /* without the guard and with a lenient threshold the same block stops: it is the guard that holds it */
            struct asked a;
            struct lull_pair pairs[] = {{"tail-share", "1"}, {"threshold", "1e6"}}, guard_only[] = {{"threshold", "1e6"}};
            begin(&a, judges[i], pairs, 2, 1);
            assert_int_equal(ask(&a, r).action, LULL_STOP);
            a.criterion->destroy(a.instance);
            begin(&a, judges[i], guard_only, 1, 1);
            assert_int_equal(ask(&a, r).action, LULL_CONTINUE);
            a.criterion->destroy(a.instance);
            free(r);
        }
}

/* One firefly in 10^5 samples on a small picture region that is otherwise constant, checked at the first check. */
static void one_firefly_in_1e5_samples(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++)
        for (int half = 0; half < 2; half++) {
            struct render *r = render_new();
            add(r, black, 16);
            for (int c = 0; c < 3; c++) {
                r->color[777][c] += 100;
                r->half[777][c] += half ? 100 : 0;
            }
            r->moment2[777] += 1e4;
            struct lull_decision d = ask_once(judges[i], r);
            assert_int_equal(d.action, LULL_CONTINUE);
            free(r);
        }
}

/* A coin per sample: relative standard error 1/sqrt(n) (variance 1/4, mean 1/2). */
static void variance_measures_the_standard_error(void **state)
{
    (void)state;
    struct render *r = render_new();
    for (uint64_t spp = 16; spp <= 64; spp *= 2) {
        add(r, coin, spp);
        double sum = 0;
        for (int i = 0; i < PIXELS; i++) {
            double n = (double)spp, m = r->color[i][0] / n, v = r->moment2[i] / n - m * m;
            double level = fmax(m, 0.02);
            sum += v / (n - 1) / (level * level);
        }
        struct lull_decision d = ask_once("variance", r);
        assert_true(fabs(d.error - sqrt(sum / PIXELS)) < 1e-9);
        assert_true(fabs(d.error * sqrt((double)spp) - 1) < 0.25);
        assert_int_equal(d.action, LULL_CONTINUE);
        assert_int_equal(d.next_spp, spp + spp / 2);
        /* the error falls as 1/sqrt(n): expected at n (e / threshold)^2 */
        double expected = (double)spp * pow(d.error / 0.03, 2);
        assert_true(isnan(d.predicted_spp) || fabs(d.predicted_spp / expected - 1) < 1e-9);
    }
    free(r);
}

/* Per pixel sample counts replace the block's. */
static void variance_reads_the_pixels_own_counts(void **state)
{
    (void)state;
    struct render *r = render_new();
    add(r, coin, 32);
    struct lull_decision block = ask_once("variance", r);
    r->with_pixel_spp = 1;
    for (int i = 0; i < PIXELS; i++)
        r->pixel_spp[i] = 32;
    struct lull_decision same = ask_once("variance", r);
    assert_true(same.error == block.error);
    for (int i = 0; i < PIXELS; i++)
        r->pixel_spp[i] = 125; /* 31 -> 124 degrees of freedom: half the standard error */
    struct lull_decision more = ask_once("variance", r);
    assert_true(fabs(more.error / block.error - 0.5) < 1e-9);
    r->pixel_spp[5] = 1;
    assert_int_equal(ask_once("variance", r).flags, LULL_DECISION_TOO_EARLY);
    free(r);
}

/* Dammertz et al. 2010: mean of |I - A|_1 / sqrt(|I|_1) times sqrt(block / picture), here sqrt(1/4). */
static void halfbuf_measures_the_two_buffer_error(void **state)
{
    (void)state;
    struct render *r = render_new();
    add(r, coin, 64);
    double sum = 0;
    for (int i = 0; i < PIXELS; i++) {
        double full = r->color[i][0] / 64, half = r->half[i][0] / 32;
        sum += 3 * fabs(full - half) / sqrt(3 * full);
    }
    struct lull_decision d = ask_once("halfbuf", r);
    assert_true(fabs(d.error - 0.5 * sum / PIXELS) < 1e-9);

    struct asked a;
    struct lull_pair no_area = {"area", "0"};
    begin(&a, "halfbuf", &no_area, 1, 1);
    assert_true(fabs(ask(&a, r).error - sum / PIXELS) < 1e-9);
    a.criterion->destroy(a.instance);
    begin(&a, "halfbuf", &no_area, 1, 4); /* e grows as the square root of the exposure */
    assert_true(fabs(ask(&a, r).error - 2 * sum / PIXELS) < 1e-9);
    a.criterion->destroy(a.instance);
    free(r);
}

/* A quarter of the samples in HALF must measure about the same error as a half of them. */
static void halfbuf_allows_for_other_splits(void **state)
{
    (void)state;
    struct render *even = render_new(), *quarter = render_new();
    add(even, coin, 256);
    quarter->random = 99;
    for (int i = 0; i < PIXELS; i++)
        for (int s = 0; s < 256; s++) {
            double v = splitmix_uniform(&quarter->random) < 0.5;
            for (int c = 0; c < 3; c++) {
                quarter->color[i][c] += v;
                quarter->half[i][c] += s % 4 == 0 ? v : 0;
            }
        }
    quarter->spp = 256;
    quarter->half_spp = 64;
    double a = ask_once("halfbuf", even).error, b = ask_once("halfbuf", quarter).error;
    assert_true(fabs(b / a - 1) < 0.02);
    quarter->half_spp = 256; /* no independent half at all: the buffers would never differ */
    assert_int_equal(ask_once("halfbuf", quarter).flags & LULL_DECISION_TOO_EARLY, LULL_DECISION_TOO_EARLY);
    quarter->half_spp = 0;
    assert_int_equal(ask_once("halfbuf", quarter).flags & LULL_DECISION_TOO_EARLY, LULL_DECISION_TOO_EARLY);
    free(even);
    free(quarter);
}

/* Noise falls until the block stops, by checks that the criterion schedules itself: geometric, so few. */
static void noise_stops_in_the_end(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct render *r = render_new();
        struct asked a;
        struct lull_pair pairs[] = {{"threshold", i ? "0.02" : "0.1"}};
        begin(&a, judges[i], pairs, 1, 1);
        struct lull_decision d;
        uint64_t next = 16;
        int checks = 0;
        do {
            add(r, coin, next);
            d = ask(&a, r);
            assert_true(d.action == LULL_STOP || (d.next_spp > r->spp && d.next_spp <= r->spp + r->spp / 2 + 1));
            next = d.next_spp;
            checks++;
        } while (d.action == LULL_CONTINUE && checks < 30);
        assert_int_equal(d.action, LULL_STOP);
        assert_in_range(r->spp, 30, 2000);
        assert_in_range(checks, 3, 15);
        a.criterion->destroy(a.instance);
        free(r);
    }
}

/* A few NaN pixels neither stop a noisy block nor keep a quiet one alive; a block of nothing else ends flagged. */
static void nan_is_left_out_and_flagged(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct render *quiet = render_new(), *noisy = render_new();
        add(quiet, constant, 16);
        add(noisy, coin, 16);
        quiet->color[3][1] = noisy->color[3][1] = (double)NAN;
        quiet->color[4][0] = noisy->color[4][0] = (double)INFINITY;
        struct lull_decision q = ask_once(judges[i], quiet), n = ask_once(judges[i], noisy);
        assert_int_equal(q.action, LULL_STOP);
        assert_int_equal(n.action, LULL_CONTINUE);
        assert_int_equal(q.flags, LULL_DECISION_BAD_INPUT);
        assert_int_equal(n.flags, LULL_DECISION_BAD_INPUT);
        for (int p = 0; p < PIXELS; p++)
            quiet->color[p][2] = (double)NAN;
        q = ask_once(judges[i], quiet);
        assert_int_equal(q.action, LULL_CONTINUE);
        assert_int_equal(q.flags, LULL_DECISION_BAD_INPUT);
        assert_true(isnan(q.error));
        quiet->spp = 4096;
        quiet->half_spp = 2048;
        q = ask_once(judges[i], quiet);
        assert_int_equal(q.action, LULL_STOP);
        assert_int_equal(q.flags, LULL_DECISION_BAD_INPUT);
        free(quiet);
        free(noisy);
    }
}

static void numbers_are_read_without_the_locale(void **state)
{
    (void)state;
    struct render *r = render_new();
    static const struct {
        const char *text;
        double spp;
    } cases[] = {{"100", 100}, {"1e2", 100}, {"+100.0", 100}, {"1000e-1", 100}, {"0.1E3", 100}, {"100.", 100}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct asked a;
        struct lull_pair pair = {"spp", cases[i].text};
        begin(&a, "fixed", &pair, 1, 1);
        assert_true(ask(&a, r).predicted_spp == cases[i].spp);
        a.criterion->destroy(a.instance);
    }
    free(r);
}

int main(void)
{
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return 2;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(null_never_stops),
        cmocka_unit_test(fixed_stops_at_its_number),
        cmocka_unit_test(black_and_constant_stop_with_error_0),
        cmocka_unit_test(too_early_is_said),
        cmocka_unit_test(a_firefly_does_not_stop),
        cmocka_unit_test(one_firefly_in_1e5_samples),
        cmocka_unit_test(variance_measures_the_standard_error),
        cmocka_unit_test(variance_reads_the_pixels_own_counts),
        cmocka_unit_test(halfbuf_measures_the_two_buffer_error),
        cmocka_unit_test(halfbuf_allows_for_other_splits),
        cmocka_unit_test(noise_stops_in_the_end),
        cmocka_unit_test(nan_is_left_out_and_flagged),
        cmocka_unit_test(numbers_are_read_without_the_locale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
