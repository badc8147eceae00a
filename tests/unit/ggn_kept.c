/* What is seen of the error of a kept picture, on blocks whose errors are known: each test has a closed form. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "sight/kept.h"

enum { SIDE = 120, MOST = SIDE * SIDE };

/* Of float maps, blurred: sums of thousands of them. */
static const double ROUNDING = 1e-5;
/* sqrt(cbrt(15)): the sixth power's root of a Gaussian of unit variance; texture hides with the root of 2 where there is none. */
static const double SEEN = 1.5704178024750197 / 1.4142135623730951;

static float lightness[2][MOST], slope[MOST], noisy[2][MOST], crossed[2][MOST], apart[MOST];

/* A flat picture without noise of which a perfect one is kept. */
static struct ggn_kept flat(int width, int height)
{
    for (int i = 0; i < width * height; i++) {
        lightness[0][i] = lightness[1][i] = 50;
        slope[i] = 120;
        noisy[0][i] = noisy[1][i] = crossed[0][i] = crossed[1][i] = 0.2f;
        apart[i] = 0;
    }
    return (struct ggn_kept){
        width, height, {lightness[0], lightness[1]}, slope, {noisy[0], noisy[1]}, {crossed[0], crossed[1]}, apart};
}

/* The memory ends where ggn_kept_scratch says: of another use of it the address sanitizer tells. */
static struct ggn_kept_errors judge(const struct ggn_kept *kept, const struct ggn_viewing *viewing)
{
    double *scratch = malloc(ggn_kept_scratch(kept->width, kept->height) * sizeof *scratch);
    assert_non_null(scratch);
    const struct ggn_kept_errors e = ggn_kept_judge(kept, viewing, scratch);
    free(scratch);
    return e;
}

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) <= ROUNDING * fmax(fabs(expected), 1.0)))
        fail_msg("%.9g is not %.9g", value, expected);
}

static const int sizes[][2] = {{1, 1}, {2, 1}, {1, 101}, {37, 101}, {SIDE, SIDE}};
enum { SIZES = sizeof sizes / sizeof sizes[0] };

static void a_perfect_picture_has_no_error(void **unused)
{
    (void)unused;
    for (int s = 0; s < SIZES; s++) {
        const struct ggn_kept k = flat(sizes[s][0], sizes[s][1]);
        const struct ggn_kept_errors e = judge(&k, NULL);
        assert_true(e.halves == 0 && e.crossed == 0);
    }
}

/* Both halves are off by as much: they agree, and the noisy ones tell. Of three pixels and less nobody knows how far their mean
 * square is off: half of it is added. */
static void bias_is_seen_by_crossing(void **unused)
{
    (void)unused;
    for (int s = 0; s < SIZES; s++)
        for (int sign = -1; sign <= 1; sign += 2) {
            const struct ggn_kept k = flat(sizes[s][0], sizes[s][1]);
            for (int i = 0; i < k.width * k.height; i++)
                crossed[0][i] = crossed[1][i] = 0.2f + (float)sign * 0.01f;
            const struct ggn_kept_errors e = judge(&k, NULL);
            assert_true(e.halves == 0);
            assert_near(e.crossed, SEEN * 120 * 0.01 * (k.width * k.height > 3 ? 1 : sqrt(1.5)));
        }
}

/* The noisy halves are kept as they are, 0.01 apart: of their mean the error is half of that. */
static void noise_that_is_kept_counts_as_that_of_the_mean(void **unused)
{
    (void)unused;
    const struct ggn_kept k = flat(SIDE, 70);
    for (int i = 0; i < k.width * k.height; i++)
        noisy[1][i] = crossed[1][i] = 0.21f;
    assert_near(judge(&k, NULL).crossed, SEEN * 120 * 0.005);
}

/* Halves 0.02 apart of which nothing is left: (P - A)^2 less (A - B)^2 / 2 is below zero, which counts as if above. */
static void below_zero_counts_as_above(void **unused)
{
    (void)unused;
    const struct ggn_kept k = flat(SIDE, 70);
    for (int i = 0; i < k.width * k.height; i++) {
        noisy[0][i] = 0.21f;
        noisy[1][i] = 0.19f;
    }
    assert_near(judge(&k, NULL).crossed, SEEN * 120 * 0.01);
}

/* The halves' difference alone: as it is seen, and never more than the crossed error. */
static void halves_are_the_least_of_the_crossed_error(void **unused)
{
    (void)unused;
    for (int s = 0; s < SIZES; s++) {
        const struct ggn_kept k = flat(sizes[s][0], sizes[s][1]);
        for (int i = 0; i < k.width * k.height; i++)
            apart[i] = -0.7f;
        const struct ggn_kept_errors e = judge(&k, NULL);
        assert_near(e.halves, 0.7 / sqrt(2));
        assert_near(e.crossed, SEEN * 0.7);
    }
}

/* One of the 16 tiles of a patch is wrong: over the patch its square would count a sixteenth, its sixth power does. The blur
 * takes a little from its border. */
static void a_small_place_counts_by_its_sixth_power(void **unused)
{
    (void)unused;
    const struct ggn_kept k = flat(100, 100);
    for (int y = 25; y < 50; y++)
        for (int x = 50; x < 75; x++)
            crossed[0][y * 100 + x] = crossed[1][y * 100 + x] = 0.25f;
    const double e = judge(&k, NULL).crossed, alone = SEEN * 120 * 0.05 * pow(16, -1.0 / 6);
    if (!(e > 0.9 * alone && e < alone))
        fail_msg("%g is not a little below %g", e, alone);
    assert_true(alone > 2 * SEEN * 120 * 0.05 / 4); /* far above what the mean square says */
}

/* In a moving picture noise counts by its gain, bias as it is. */
static void what_moves(void **unused)
{
    (void)unused;
    struct ggn_viewing t;
    const struct ggn_kept k = flat(64, 64);
    ggn_viewing_init(&t, 24, 67);
    for (int i = 0; i < k.width * k.height; i++)
        crossed[0][i] = crossed[1][i] = 0.21f;
    assert_near(judge(&k, &t).crossed, SEEN * 120 * 0.01);
    static float same[64 * 64];
    for (int i = 0; i < 64 * 64; i++)
        apart[i] = same[i] = 0.5f;
    const double gain = ggn_viewing_gain(&t, same, 64, 64, NULL);
    assert_true(gain > 1.5); /* so coarse that it is seen to come and go */
    const struct ggn_kept_errors still = judge(&k, NULL), moving = judge(&k, &t);
    assert_near(moving.halves, gain * still.halves);
    assert_near(moving.crossed * moving.crossed,
                still.crossed * still.crossed + (gain * gain - 1) * still.halves * still.halves);
}

/* From farther away fine errors fade, the bias as well as the noise. */
static void what_is_far(void **unused)
{
    (void)unused;
    struct ggn_viewing t;
    const struct ggn_kept k = flat(64, 64);
    ggn_viewing_init(&t, 0, 134);
    for (int i = 0; i < 64 * 64; i++) {
        crossed[0][i] = crossed[1][i] = 0.21f;
        apart[i] = (i / 64 + i) % 2 ? 0.05f : -0.05f;
    }
    const struct ggn_kept_errors near = judge(&k, NULL), far = judge(&k, &t);
    assert_true(near.crossed > 2 * near.halves && far.halves < 0.2 * near.halves);
    assert_near(far.crossed * near.halves, far.halves * near.crossed);
}

/* Texture hides: of both halves' L* the common part. */
static void texture_hides(void **unused)
{
    (void)unused;
    const struct ggn_kept k = flat(100, 100);
    for (int i = 0; i < 100 * 100; i++) {
        lightness[0][i] = lightness[1][i] = 50.0f + ((i / 100 + i) % 2 ? 8.0f : -8.0f);
        apart[i] = 1;
    }
    const double e = judge(&k, NULL).halves; /* a checker of 8 has the standard deviation 8 in 5x5 px, up to its edges */
    if (!(e > 0.98 / sqrt(10) && e < 1.02 / sqrt(10)))
        fail_msg("%g is not %g", e, 1 / sqrt(10));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_perfect_picture_has_no_error),
        cmocka_unit_test(bias_is_seen_by_crossing),
        cmocka_unit_test(noise_that_is_kept_counts_as_that_of_the_mean),
        cmocka_unit_test(below_zero_counts_as_above),
        cmocka_unit_test(halves_are_the_least_of_the_crossed_error),
        cmocka_unit_test(a_small_place_counts_by_its_sixth_power),
        cmocka_unit_test(what_moves),
        cmocka_unit_test(what_is_far),
        cmocka_unit_test(texture_hides),
    };
    return cmocka_run_group_tests_name("kept", tests, NULL, NULL);
}
