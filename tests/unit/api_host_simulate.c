/* Levels beyond a recording: what lull_host_simulate makes of pixels against its closed form, and what it refuses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include <lull/host_draft.h>

enum { P = 2 };

static struct lull_host_simulation made(const double *color, double *half, double *moment2)
{
    return (struct lull_host_simulation){.struct_size = sizeof(struct lull_host_simulation),
                                         .pixels = P,
                                         .spp = 12,
                                         .half_spp = 4,
                                         .to_spp = 100,
                                         .color = color,
                                         .half = half,
                                         .moment2 = moment2};
}

/* Means of h and n - h samples of variance s^2 differ by s sqrt(1/h + 1/(n - h)); the half of h lies (n - h)/n of that from the
 * mean: at 12 samples, 4 in the half, s sqrt(3/8) 2/3, and at 100, 50 in the half, s sqrt(1/25) / 2. */
static void noise_of_so_many_samples(void **state)
{
    const double color[3 * P] = {1, 2, 3, 0.5, 0, 7}, s[3 * P] = {0.1, -0.2, 0.3, 0, 1, 2};
    double half[3 * P], moment2[P];
    (void)state;
    for (int i = 0; i < 3 * P; i++)
        half[i] = color[i] + s[i] * sqrt(3.0 / 8) * 2 / 3;
    for (int i = 0; i < P; i++) {
        const double *c = color + 3 * i, y = 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2];
        moment2[i] = y * y + 0.09 * 11 / 12; /* of 12 samples of variance 0.09 */
    }
    const struct lull_host_simulation sim = made(color, half, moment2);
    assert_int_equal(lull_host_simulate(&sim, NULL), LULL_OK);
    for (int i = 0; i < 3 * P; i++)
        assert_true(fabs(half[i] - color[i] - s[i] / 10) <= 1e-12);
    for (int i = 0; i < P; i++) {
        const double *c = color + 3 * i, y = 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2];
        assert_true(fabs(moment2[i] - y * y - 0.09 * 99 / 100) <= 1e-12);
    }
}

/* In two steps as in one; other primaries weigh otherwise; what is not there is left out. */
static void steps_and_weights(void **state)
{
    const double color[3 * P] = {1, 2, 3, 4, 5, 6};
    double one[3 * P] = {2, 1, 4, 4, 4.5, 9}, two[3 * P], m[P] = {5, 30}, n[P] = {5, 30};
    (void)state;
    memcpy(two, one, sizeof one);
    struct lull_host_simulation sim = made(color, one, m);
    assert_int_equal(lull_host_simulate(&sim, NULL), LULL_OK);
    sim.half = two, sim.moment2 = n, sim.to_spp = 31;
    assert_int_equal(lull_host_simulate(&sim, NULL), LULL_OK);
    sim.spp = 31, sim.half_spp = 15, sim.to_spp = 100;
    assert_int_equal(lull_host_simulate(&sim, NULL), LULL_OK);
    for (int i = 0; i < 3 * P; i++)
        assert_true(fabs(one[i] - two[i]) <= 1e-12);
    for (int i = 0; i < P; i++)
        assert_true(fabs(m[i] - n[i]) <= 1e-12);
    double k[P] = {5, 30};
    sim = made(color, NULL, k);
    sim.rgb_to_xyz[3] = 1; /* Y is red */
    assert_int_equal(lull_host_simulate(&sim, NULL), LULL_OK);
    for (int i = 0; i < P; i++)
        assert_true(fabs(k[i] - (color[3 * i] * color[3 * i] +
                                 ((i ? 30 : 5) - color[3 * i] * color[3 * i]) * 12 / 11 * 99 / 100)) <= 1e-12);
}

static void refusals(void **state)
{
    const double color[3 * P] = {0};
    double half[3 * P] = {1}, moment2[P] = {1};
    (void)state;
    for (int i = 0; i < 9; i++) {
        struct lull_error e = {.struct_size = sizeof e};
        struct lull_host_simulation s = made(color, half, moment2);
        static const char *const words[] = {
            "struct_size", "color is NULL", "from 0 to 100", "from 12 to 12", "from 12 to 2147483648",
            "half_spp 0",  "half_spp 12",   "rgb_to_xyz",    "simulation"};
        if (i == 0)
            s.struct_size--;
        else if (i == 1)
            s.color = NULL;
        else if (i == 2)
            s.spp = 0;
        else if (i == 3)
            s.to_spp = 12;
        else if (i == 4)
            s.to_spp = UINT64_C(1) << 31;
        else if (i == 5)
            s.half_spp = 0;
        else if (i == 6)
            s.half_spp = 12;
        else if (i == 7)
            s.rgb_to_xyz[4] = (double)NAN;
        assert_true(lull_host_simulate(i == 8 ? NULL : &s, &e) < 0);
        assert_non_null(strstr(e.message, words[i]));
        assert_true(half[0] == 1 && moment2[0] == 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(noise_of_so_many_samples), cmocka_unit_test(steps_and_weights),
                                       cmocka_unit_test(refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
