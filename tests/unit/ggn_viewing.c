/* Noise from another distance, and noise that is new in each frame: the model against ColorVideoVDP's own numbers, and what it makes of fine and coarse noise. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>

#include "nn/hash.h"
#include "support/ggn_near.h"

#include "sight/viewing.h"

enum { SIDE = 200 };

/* sqrt(|F_s|^2 + (|F_t| S_t / S_s)^2) at 64, 32, 16, ..., 1/8 cycles per degree, of ColorVideoVDP 0.5.7: its get_temporal_filters
 * for that many frames per second (norms of their taps) and its table csf_lut_weber_fixed_size at 37 cd/m^2, by numpy 1.24. */
static const double gains_24[] = {1.416084, 0.831508, 0.659948, 0.615271, 0.636904,
                                  0.752179, 1.141241, 1.920378, 2.898627, 3.974232};
static const double gains_60[] = {0.992408, 0.575856, 0.452095, 0.419599, 0.435352,
                                  0.518793, 0.797127, 1.349607, 2.040913, 2.800153};

static void of_spatial_bands(void **state)
{
    const double tolerance = 2e-5; /* filters in single precision there */
    struct ggn_viewing t;
    (void)state;
    ggn_viewing_init(&t, 24, 64 / sqrt(0.125));
    for (int k = 0; k < 10; k++)
        assert_near(t.gain[k] / t.still[k], gains_24[k], tolerance);
    assert_near(t.gain[10] / t.still[10], t.gain[9] / t.still[9], tolerance);
    ggn_viewing_init(&t, 60, 64 / sqrt(0.125));
    for (int k = 0; k < 10; k++)
        assert_near(t.gain[k] / t.still[k], gains_60[k], tolerance);
    ggn_viewing_init(&t, 24, 32 / sqrt(0.125)); /* from twice as near */
    for (int k = 0; k < 9; k++)
        assert_near(t.gain[k] / t.still[k], gains_24[k + 1], tolerance);
}

static void of_a_still(void **state)
{
    struct ggn_viewing t;
    float noise[6] = {1, -2, 3, 0, 5, 1};
    (void)state;
    ggn_viewing_init(&t, 0, 67);
    for (int k = 0; k < GGN_VIEWING_BANDS; k++)
        assert_true(t.gain[k] == 1.0 && t.still[k] == 1.0);
    assert_true(ggn_viewing_gain(&t, noise, 3, 2, NULL) == 1.0);
}

/* log2 of the sustained channel's sensitivity at 64, 32, ..., 1/4 cycles per degree, from the same table. */
static const double sensitivities[] = {-0.0010, 3.0284, 5.4363, 7.1619, 8.0456, 8.0139, 7.1694, 6.1033, 5.1115};

static void from_another_distance(void **state)
{
    struct ggn_viewing near, far;
    (void)state;
    ggn_viewing_init(&far, 0, 64 / sqrt(0.125));
    ggn_viewing_init(&near, 0, 32 / sqrt(0.125));
    for (int k = 0; k + 1 < 9; k++) {
        assert_near(far.still[k] / near.still[k], exp2(sensitivities[k] - sensitivities[k + 1]), 2e-5);
        assert_true(far.gain[k] == far.still[k]);
    }
    for (int k = 0; k < 3; k++) /* up to 6 cycles per degree the finer is seen less */
        assert_true(far.still[k] < far.still[k + 1]);
}

/* Means of squares of `coarse` px of independent noise. */
static double gain_of(const struct ggn_viewing *t, int width, int height, int coarse)
{
    float *noise = malloc((size_t)width * (size_t)height * sizeof *noise);
    assert_non_null(noise);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            noise[y * width + x] = (float)ggn_hash_unit((uint32_t)(y / coarse), (uint32_t)(x / coarse)) - 0.5f;
    double gain = ggn_viewing_gain(t, noise, width, height, NULL);
    free(noise);
    return gain;
}

static void fine_and_coarse_noise(void **state)
{
    struct ggn_viewing t;
    (void)state;
    ggn_viewing_init(&t, 24, 67);
    /* white: three quarters of its power are in the first band, three quarters of the rest in the next */
    double white = sqrt((12 * t.gain[0] * t.gain[0] + 3 * t.gain[1] * t.gain[1] + t.gain[2] * t.gain[2]) / 16);
    assert_near(gain_of(&t, SIDE, SIDE, 1), white, 0.01);
    assert_true(white > 0.6 && white < 0.75);
    assert_near(gain_of(&t, SIDE - 1, SIDE - 3, 1), white, 0.02);
    assert_true(gain_of(&t, 128, 128, 32) > 1.2);
    for (int coarse = 2; coarse < 64; coarse *= 2) /* from 3 cycles per degree down ever more visible */
        assert_true(coarse < 4 || gain_of(&t, 128, 128, 2 * coarse) > gain_of(&t, 128, 128, coarse));
}

static void of_few_pixels(void **state)
{
    struct ggn_viewing t;
    float one = 0.5f, none[2] = {0, 0}, row[3] = {1, 2, 3};
    (void)state;
    ggn_viewing_init(&t, 24, 67);
    assert_near(ggn_viewing_gain(&t, &one, 1, 1, NULL), t.gain[0], 1e-12);
    assert_near(ggn_viewing_gain(&t, none, 2, 1, NULL), t.gain[0], 1e-12);
    assert_near(ggn_viewing_gain(&t, row, 1, 3, NULL), t.gain[0], 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(of_spatial_bands),      cmocka_unit_test(of_a_still),    cmocka_unit_test(from_another_distance),
        cmocka_unit_test(fine_and_coarse_noise), cmocka_unit_test(of_few_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
