#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sample/sampler.h"

/* Direction numbers of the second Sobol' dimension by its recurrence (primitive polynomial x + 1): v_k = v_{k-1} ^ v_{k-1} >> 1.
 * Those of the first are single bits. */
static void second_dimension_is_sobol(void **state)
{
    (void)state;
    uint32_t v = 0x80000000u;
    for (int k = 0; k < 32; k++) {
        assert_int_equal(pt_sobol_second(0x80000000u >> k), v);
        v ^= v >> 1;
    }
}

/* Every elementary interval of the first 2^m samples of a pair holds exactly one: scrambling keeps the (0, m, 2)-net. */
static void pairs_are_nets(void **state)
{
    (void)state;
    enum { M = 8, N = 1 << M };
    for (uint32_t pixel = 0; pixel < 8; pixel++)
        for (uint32_t dim = 0; dim < 6; dim += 2)
            for (int split = 0; split <= M; split++) {
                unsigned char seen[N] = {0};
                for (uint32_t i = 0; i < N; i++) {
                    struct pt_sampler s = pt_sampler_make(1, 7, pixel, 3, i);
                    pt_sampler_block(&s, 2);
                    struct pt_sample2 p = pt_sampler_2d(&s, dim);
                    assert_true(p.x >= 0.0f && p.x < 1.0f && p.y >= 0.0f && p.y < 1.0f);
                    int x = (int)(p.x * (float)(1 << split)), y = (int)(p.y * (float)(1 << (M - split)));
                    seen[(x << (M - split)) + y]++;
                }
                for (int i = 0; i < N; i++)
                    assert_int_equal(seen[i], 1);
            }
}

/* Correlation of two sequences of numbers, which should be about 1/sqrt(n). */
static void dimensions_are_uncorrelated(void **state)
{
    (void)state;
    enum { N = 4096 };
    for (int kind = 0; kind < 2; kind++)
        for (uint32_t a = 0; a < 8; a++)
            for (uint32_t b = a + 1; b < 8; b++) {
                double sum = 0.0;
                for (uint32_t i = 0; i < N; i++) {
                    struct pt_sampler s = pt_sampler_make(kind, 1, i % 64, i / 64, i);
                    pt_sampler_block(&s, 1);
                    sum += ((double)pt_sampler_1d(&s, a) - 0.5) * ((double)pt_sampler_1d(&s, b) - 0.5) * 12.0;
                }
                assert_true(sum / N > -5.0 / 64.0 && sum / N < 5.0 / 64.0);
            }
}

static void numbers_depend_on_their_key_only(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        struct pt_sampler a = pt_sampler_make(kind, 1, 5, 6, 7), b = pt_sampler_make(kind, 1, 5, 6, 7);
        pt_sampler_block(&a, 9);
        pt_sampler_block(&a, 3);
        pt_sampler_block(&b, 3);
        assert_true(pt_sampler_1d(&a, 4) == pt_sampler_1d(&b, 4));
        uint32_t changed = 0;
        for (uint32_t i = 1; i <= 4; i++) {
            struct pt_sampler c = pt_sampler_make(kind, 1 + (i == 1), 5 + (i == 2), 6 + (i == 3), 7 + (i == 4));
            pt_sampler_block(&c, 3);
            changed += pt_sampler_1d(&a, 4) != pt_sampler_1d(&c, 4);
        }
        assert_int_equal(changed, 4);
    }
}

/* Mean of the stream and of its lag-1 product. */
static void streams_are_uniform(void **state)
{
    (void)state;
    enum { N = 100000 };
    double mean = 0.0, lag = 0.0, last = 0.5;
    struct pt_rng rng = pt_rng_make(3);
    for (int i = 0; i < N; i++) {
        double u = (double)pt_rng_float(&rng);
        mean += u / N;
        lag += (u - 0.5) * (last - 0.5) * 12.0 / N;
        last = u;
    }
    assert_true(mean > 0.495 && mean < 0.505 && lag > -0.02 && lag < 0.02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(second_dimension_is_sobol),       cmocka_unit_test(pairs_are_nets),
        cmocka_unit_test(dimensions_are_uncorrelated),     cmocka_unit_test(numbers_depend_on_their_key_only),
        cmocka_unit_test(streams_are_uniform),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
