#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "sample/sampler.h"

/* Direction numbers of the second Sobol' dimension by its recurrence (primitive polynomial x + 1): v_k = v_{k-1} ^ v_{k-1} >> 1.
 * Those of the first are single bits. All reversed. */
static void second_dimension_is_sobol(void **state)
{
    (void)state;
    uint32_t v = 0x80000000u;
    for (int k = 0; k < 32; k++) {
        assert_int_equal(pt_sobol_second(1u << k), pt_reverse_bits(v));
        v ^= v >> 1;
    }
}

/* The i-th sample of one of a pixel's two sequences. */
static struct pt_sampler sample_of(uint32_t seed, uint32_t x, uint32_t y, uint32_t sequence, uint32_t i)
{
    return pt_sampler_make(1, seed, x, y, 2 * i + sequence);
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
                    struct pt_sampler s = sample_of(7, pixel, 3, pixel % 2, i);
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

/* So do single numbers, of the camera and of each vertex that still has Sobol' points: one in each of 2^m intervals. */
static void single_numbers_are_stratified(void **state)
{
    (void)state;
    enum { N = 256 };
    for (uint32_t block = 0; block < PT_SOBOL_BLOCKS; block++)
        for (uint32_t dim = 0; dim < PT_DIMS_PER_VERTEX; dim++) {
            unsigned char seen[N] = {0};
            for (uint32_t i = 0; i < N; i++) {
                struct pt_sampler s = sample_of(7, 5, 3, dim % 2, i);
                pt_sampler_block(&s, block);
                seen[(int)(pt_sampler_1d(&s, dim) * N)]++;
            }
            for (int i = 0; i < N; i++)
                assert_int_equal(seen[i], 1);
        }
}

/* Where a number lies within its stratum is known from no other number of the pixel: offsets have the variance 1/12 (6 standard
 * errors of it) and no correlation with the offset of the next stratum. */
static void offsets_within_strata_are_independent(void **state)
{
    enum { N = 64, PIXELS = 256, ALL = N * PIXELS };
    (void)state;
    for (int axis = 0; axis < 3; axis++) { /* of a pair: x, y; a single number */
        double mean = 0.0, square = 0.0, lag = 0.0;
        for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
            double offset[N] = {0}, own = 0.0;
            for (uint32_t i = 0; i < N; i++) {
                struct pt_sampler s = sample_of(7, pixel, 3, pixel % 2, i);
                struct pt_sample2 p = pt_sampler_2d(&s, PT_DIM_LENS);
                float u = N * (axis == 0 ? p.x : axis == 1 ? p.y : pt_sampler_1d(&s, PT_DIM_TIME));
                offset[(int)u] = (double)(u - floorf(u)) - 0.5;
            }
            for (int i = 0; i < N; i++)
                own += offset[i] / N;
            mean += own / PIXELS;
            for (int i = 0; i < N; i++) {
                square += (offset[i] - own) * (offset[i] - own) * 12.0 / (ALL - PIXELS);
                lag += offset[i] * offset[(i + 1) % N] * 12.0 / ALL;
            }
        }
        if (!(fabs(mean) < 6.0 / sqrt(12.0 * ALL) && fabs(square - 1.0) < 6.0 * sqrt(0.8 / ALL) &&
              fabs(lag) < 6.0 / sqrt(ALL)))
            fail_msg("axis %d: offsets have the mean %g, %g of the variance 1/12, correlation %g with the next", axis, mean,
                     square, lag);
    }
}

/* Variance of the mean of n samples over pixels, of e^x or e^(x + y). */
static double variance_of_smooth(int width, uint32_t n)
{
    enum { PIXELS = 512 };
    double sum = 0.0, square = 0.0;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
        double mean = 0.0;
        for (uint32_t i = 0; i < n; i++) {
            struct pt_sampler s = pt_sampler_make(1, 11, pixel, 5, i);
            struct pt_sample2 p = pt_sampler_2d(&s, PT_DIM_PIXEL);
            mean += exp((double)p.x + (width == 2 ? (double)p.y : 0.0)) / n;
        }
        sum += mean / PIXELS;
        square += mean * mean / PIXELS;
    }
    return square - sum * sum;
}

/* The variance of a smooth function's mean falls as n^-3 in one dimension and n^-3 log n in two (Owen 1997, "Scrambled net variance for
 * integrals of smooth functions"), with one offset for all strata as n^-2: 64 to 1024 samples are worth 4096, some 2000, and 256. */
static void smooth_functions_converge_faster(void **state)
{
    (void)state;
    for (int width = 1; width <= 2; width++) {
        double fall = variance_of_smooth(width, 64) / variance_of_smooth(width, 1024);
        if (!(fall > 1000.0))
            fail_msg("%d dimensions: the variance falls by %g", width, fall);
    }
}

/* Errors of both sequences' means, over pixels, of a function with an edge, as at a shadow or a lamp. Even and odd
 * samples of one sequence have a correlation of -0.92 here. Bound: six standard errors of none. */
static void sequences_are_independent(void **state)
{
    enum { PIXELS = 4096, N = 32 };
    double sum[2] = {0}, square[2] = {0}, both = 0.0;
    (void)state;
    for (uint32_t pixel = 0; pixel < PIXELS; pixel++) {
        double mean[2] = {0};
        for (uint32_t i = 0; i < 2 * N; i++) {
            struct pt_sampler s = pt_sampler_make(1, 7, pixel, 3, i);
            struct pt_sample2 p = pt_sampler_2d(&s, PT_DIM_LIGHT);
            mean[i % 2] += (p.x + 0.37f * p.y < 0.61f) / (double)N;
        }
        for (int k = 0; k < 2; k++) {
            sum[k] += mean[k] / PIXELS;
            square[k] += mean[k] * mean[k] / PIXELS;
        }
        both += mean[0] * mean[1] / PIXELS;
    }
    double correlation = (both - sum[0] * sum[1]) / sqrt((square[0] - sum[0] * sum[0]) * (square[1] - sum[1] * sum[1]));
    print_message("correlation of the sequences' errors: %.3f\n", correlation);
    assert_true(fabs(correlation) < 6.0 / sqrt(PIXELS));
}

/* What a vertex and the camera draw, and how many dimensions from there. */
static const struct {
    uint32_t dim, width;
} vertex_dims[] = {{PT_DIM_BSDF, 2},     {PT_DIM_LIGHT, 2},  {PT_DIM_LIGHT_PICK, 1}, {PT_DIM_BSDF_LOBE, 1},
                   {PT_DIM_ROULETTE, 1}, {PT_DIM_MEDIUM, 1}, {PT_DIM_PHASE, 2},      {PT_DIM_ALPHA, 1},
                   {PT_DIM_SHADOW, 1},   {PT_DIM_MIX, 1},    {PT_DIM_BSDF_WALK, 1}},
  camera_dims[] = {{PT_DIM_PIXEL, 2}, {PT_DIM_LENS, 2}, {PT_DIM_TIME, 1}};

static void no_dimension_has_two_uses(void **state)
{
    (void)state;
    int camera[PT_DIMS_PER_VERTEX] = {0}, vertex[PT_DIMS_PER_VERTEX] = {0};
    for (size_t i = 0; i < sizeof vertex_dims / sizeof *vertex_dims; i++)
        for (uint32_t k = 0; k < vertex_dims[i].width; k++) {
            assert_true(vertex_dims[i].dim + k < PT_DIMS_PER_VERTEX);
            assert_int_equal(vertex[vertex_dims[i].dim + k]++, 0);
        }
    for (size_t i = 0; i < sizeof camera_dims / sizeof *camera_dims; i++)
        for (uint32_t k = 0; k < camera_dims[i].width; k++)
            assert_int_equal(camera[camera_dims[i].dim + k]++, 0);
}

enum { N_SAMPLES = 4096, N_BLOCKS = 6, N_DIMS = 14 * N_BLOCKS };

/* All numbers that the camera and five vertices draw, about 0 with variance 1; blocks beyond the third are no Sobol' points any more. */
static int draw_all(int kind, float (*u)[N_SAMPLES])
{
    int n = 0;
    for (uint32_t block = 0; block < N_BLOCKS; block++) {
        size_t uses = block ? sizeof vertex_dims / sizeof *vertex_dims : sizeof camera_dims / sizeof *camera_dims;
        for (size_t k = 0; k < uses; k++) {
            uint32_t dim = block ? vertex_dims[k].dim : camera_dims[k].dim,
                     width = block ? vertex_dims[k].width : camera_dims[k].width;
            for (uint32_t i = 0; i < N_SAMPLES; i++) {
                struct pt_sampler s = pt_sampler_make(kind, 1, i % 64, i / 64 % 4, i / 256);
                pt_sampler_block(&s, block);
                struct pt_sample2 p =
                    width == 2 ? pt_sampler_2d(&s, dim) : (struct pt_sample2){pt_sampler_1d(&s, dim), 0.0f};
                u[n][i] = (p.x - 0.5f) * sqrtf(12.0f);
                if (width == 2)
                    u[n + 1][i] = (p.y - 0.5f) * sqrtf(12.0f);
            }
            n += (int)width;
        }
    }
    return n;
}

/* χ² of two numbers over 8 by 8 squares: 63 degrees of freedom, so that 63 + 6 sqrt(126) has no place among 2,800 pairs. */
static double joint_chi2(const float *a, const float *b)
{
    enum { SIDE = 8 };
    const float to_side = SIDE / sqrtf(12.0f);
    int seen[SIDE * SIDE] = {0};
    double chi2 = 0.0, each = (double)N_SAMPLES / (SIDE * SIDE);
    for (int i = 0; i < N_SAMPLES; i++)
        seen[(int)(a[i] * to_side + SIDE / 2) * SIDE + (int)(b[i] * to_side + SIDE / 2)]++;
    for (int i = 0; i < SIDE * SIDE; i++)
        chi2 += (seen[i] - each) * (seen[i] - each) / each;
    return chi2;
}

/* No two numbers of a path know of each other, whichever vertices they belong to: neither by their product, |r| beyond 6/sqrt(n), nor by
 * where they fall together. */
static void dimensions_are_independent(void **state)
{
    (void)state;
    static float u[N_DIMS][N_SAMPLES];
    for (int kind = 0; kind < 2; kind++) {
        int n = draw_all(kind, u);
        assert_int_equal(n, 5 + 14 * (N_BLOCKS - 1));
        for (int a = 0; a < n; a++)
            for (int b = a + 1; b < n; b++) {
                float r = 0.0f;
                for (int i = 0; i < N_SAMPLES; i++)
                    r += u[a][i] * u[b][i];
                if (!(fabsf(r) < 6.0f * 64.0f))
                    fail_msg("sampler %d: numbers %d and %d have the correlation %g", kind, a, b, (double)r / N_SAMPLES);
                double chi2 = joint_chi2(u[a], u[b]);
                if (!(chi2 < 63.0 + 6.0 * sqrt(126.0)))
                    fail_msg("sampler %d: numbers %d and %d fall together with a chi-squared of %g", kind, a, b, chi2);
            }
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

/* Streams of other samples, vertices and dimensions begin with other numbers: among 64·6·4 numbers of 32 bits two are the same by
 * chance once in 3,600 choices of the seed. */
static void no_two_streams_begin_alike(void **state)
{
    static const uint32_t keys[] = {PT_DIM_ALPHA, PT_DIM_SHADOW, PT_DIM_MIX, PT_DIM_BSDF_WALK};
    enum { SAMPLES = 64, KEYS = sizeof keys / sizeof *keys, ALL = SAMPLES * N_BLOCKS * KEYS };
    static uint32_t first[ALL];
    int n = 0;
    (void)state;
    for (uint32_t i = 0; i < SAMPLES; i++)
        for (uint32_t block = 0; block < N_BLOCKS; block++)
            for (size_t k = 0; k < KEYS; k++) {
                struct pt_sampler s = pt_sampler_make(1, 1, 3, 4, i);
                pt_sampler_block(&s, block);
                struct pt_rng rng = pt_sampler_stream(&s, keys[k]);
                first[n++] = pt_rng_next(&rng);
            }
    for (int i = 0; i < ALL; i++)
        for (int k = 0; k < i; k++)
            assert_int_not_equal(first[i], first[k]);
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
        cmocka_unit_test(second_dimension_is_sobol),        cmocka_unit_test(pairs_are_nets),
        cmocka_unit_test(single_numbers_are_stratified),    cmocka_unit_test(offsets_within_strata_are_independent),
        cmocka_unit_test(smooth_functions_converge_faster), cmocka_unit_test(sequences_are_independent),
        cmocka_unit_test(no_dimension_has_two_uses),        cmocka_unit_test(dimensions_are_independent),
        cmocka_unit_test(numbers_depend_on_their_key_only), cmocka_unit_test(streams_are_uniform),
        cmocka_unit_test(no_two_streams_begin_alike),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
