/*
 * Media against closed forms: Beer–Lambert, the mean of sampled distances, unbiased tracking through grids, energy.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "shade/medium.h"

enum { SEED = 99, SAMPLES = 200000 };

static const struct pt_mat34 identity = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};

static struct pt_medium homogeneous(pt_vec3 sigma_a, pt_vec3 sigma_s)
{
    return (struct pt_medium){.kind = PT_MEDIUM_HOMOGENEOUS, .sigma_a = sigma_a, .sigma_s = sigma_s};
}

static void absorption_is_beer_lambert(void **state)
{
    (void)state;
    struct pt_medium m = homogeneous(v3(0.5f, 0.0f, 2.0f), v3_splat(0.0f));
    struct pt_rng rng = pt_rng_make(SEED), untouched = rng;
    struct pt_medium_event e;
    pt_medium_sample_distance(&m, v3_splat(0.0f), v3(0, 0, 1), 1.5f, v3_splat(1.0f), &rng, &e);
    assert_int_equal(e.scattered, 0);
    assert_true(rng.state == untouched.state);
    pt_vec3 tr = pt_medium_transmittance(&m, v3_splat(0.0f), v3(0, 0, 1), 1.5f, &rng);
    assert_true(fabs((double)e.weight.x - exp(-0.75)) < 1e-6 && e.weight.y == 1.0f &&
                fabs((double)e.weight.z - exp(-3.0)) < 1e-6);
    assert_true(tr.x == e.weight.x && tr.y == e.weight.y && tr.z == e.weight.z);
    /* nothing comes from infinitely far, but through a channel that does not absorb */
    tr = pt_medium_transmittance(&m, v3_splat(0.0f), v3(0, 0, 1), INFINITY, &rng);
    assert_true(tr.x == 0.0f && tr.y == 1.0f && tr.z == 0.0f);
}

/* Fog that glows and absorbs red, all the way to the horizon: as bright as what it emits for each unit of absorption. */
static void unbounded_glow_is_finite(void **state)
{
    (void)state;
    struct pt_medium m = homogeneous(v3(0.5f, 0.0f, 0.0f), v3_splat(0.0f));
    m.emission = v3(0.5f * 3.0f, 0.0f, 0.0f);
    struct pt_rng rng = pt_rng_make(SEED);
    struct pt_medium_event e;
    pt_medium_sample_distance(&m, v3_splat(0.0f), v3(0, 0, 1), INFINITY, v3_splat(1.0f), &rng, &e);
    assert_true(fabsf(e.emitted.x - 3.0f) < 1e-6f && e.emitted.y == 0.0f && e.emitted.z == 0.0f);
    assert_true(e.weight.x == 0.0f && e.weight.y == 1.0f);
}

/* What the path carries so far: it decides which colour is followed, and the means are the same. */
static pt_vec3 throughput = {1, 1, 1};

/* Sums of weights over scattering and passing. */
struct tally {
    double through[3], scattered[3], emitted[3], scattered_t;
};

static void run(const struct pt_medium *m, pt_vec3 origin, pt_vec3 direction, float t_max, int samples, struct tally *out)
{
    struct pt_rng rng = pt_rng_make(SEED);
    *out = (struct tally){0};
    for (int i = 0; i < samples; i++) {
        struct pt_medium_event e;
        pt_medium_sample_distance(m, origin, direction, t_max, throughput, &rng, &e);
        double *to = e.scattered ? out->scattered : out->through;
        to[0] += (double)e.weight.x / samples;
        to[1] += (double)e.weight.y / samples;
        to[2] += (double)e.weight.z / samples;
        out->emitted[0] += (double)e.emitted.x / samples;
        out->emitted[1] += (double)e.emitted.y / samples;
        out->emitted[2] += (double)e.emitted.z / samples;
        if (e.scattered) {
            assert_true(e.t >= 0.0f && e.t <= t_max);
            out->scattered_t += (double)(e.weight.x * e.t) / samples;
        }
    }
}

/* E[through] = exp(-σt d); E[scattered] = σs/σt (1 - exp(-σt d)); E[emitted] = ε/σt (1 - exp(-σt d)). */
static void check_closed_form(const struct tally *t, pt_vec3 sigma_a, pt_vec3 sigma_s, pt_vec3 emission, double d)
{
    const float a[3] = {sigma_a.x, sigma_a.y, sigma_a.z}, s[3] = {sigma_s.x, sigma_s.y, sigma_s.z};
    const float l[3] = {emission.x, emission.y, emission.z};
    const double tolerance = 6.0 / sqrt(SAMPLES); /* weights are of the order of 1 */
    for (int c = 0; c < 3; c++) {
        double st = (double)(a[c] + s[c]), tr = exp(-st * d), inside = st > 0.0 ? (1.0 - tr) / st : d;
        if (fabs(t->through[c] - tr) > tolerance || fabs(t->scattered[c] - (double)s[c] * inside) > tolerance ||
            fabs(t->emitted[c] - (double)l[c] * inside) > 2.0 * tolerance)
            fail_msg("channel %d: through %g (%g), scattered %g (%g), emitted %g (%g)", c, t->through[c], tr,
                     t->scattered[c], (double)s[c] * inside, t->emitted[c], (double)l[c] * inside);
    }
}

static void homogeneous_sampling_is_unbiased(void **state)
{
    (void)state;
    const pt_vec3 absorb[] = {{0, 0, 0}, {0.1f, 0.5f, 2.0f}, {0, 1, 0}},
                  scatter[] = {{1, 1, 1}, {0.7f, 0.7f, 0.1f}, {3, 0, 0.2f}};
    for (int i = 0; i < 6; i++) {
        struct pt_medium m = homogeneous(absorb[i / 2], scatter[i / 2]);
        m.emission = v3(0.3f, 0.0f, 1.0f);
        struct tally t;
        throughput = i % 2 ? v3(20.0f, 30.0f, 10.0f) : v3_splat(1.0f);
        run(&m, v3_splat(0.0f), v3(1, 0, 0), 0.8f, SAMPLES, &t);
        check_closed_form(&t, absorb[i / 2], scatter[i / 2], m.emission, 0.8);
    }
    throughput = v3_splat(1.0f);
}

static struct pt_medium grid(struct pt_arena *arena, const float *density, int nx, int ny, int nz, pt_vec3 a, pt_vec3 s)
{
    struct pt_medium m = {.kind = PT_MEDIUM_GRID,
                          .sigma_a = a,
                          .sigma_s = s,
                          .nx = nx,
                          .ny = ny,
                          .nz = nz,
                          .density = density,
                          .from_render = identity};
    assert_int_equal(pt_medium_grid_build(&m, arena, NULL), 0);
    return m;
}

/* In the middle of a grid of equal cells the medium is homogeneous. */
static void constant_grid_equals_homogeneous(void **state)
{
    (void)state;
    enum { N = 20 };
    static float density[N * N * N];
    for (int i = 0; i < N * N * N; i++)
        density[i] = 2.0f;
    struct pt_arena arena = {0};
    const pt_vec3 absorb[] = {{0, 0, 0}, {0.5f, 1.0f, 0.0f}}, scatter[] = {{1.5f, 1.5f, 1.5f}, {0.5f, 0.2f, 1.0f}};
    for (int i = 0; i < 2; i++) {
        struct pt_medium m = grid(&arena, density, N, N, N, absorb[i], scatter[i]);
        m.emission = v3(0.2f, 0.4f, 0.0f);
        struct tally t;
        /* from one cell inside the box to one cell before its end: no density falls off there */
        run(&m, v3(0.1f, 0.5f, 0.3f), v3(1, 0, 0), 0.8f, SAMPLES, &t);
        check_closed_form(&t, v3_scale(absorb[i], 2.0f), v3_scale(scatter[i], 2.0f), v3_scale(m.emission, 2.0f), 0.8);
    }
    pt_arena_release(&arena);
}

/* A rough field crossed at an angle: transmittance against quadrature of the density along the ray, by both estimators. */
static void tracking_through_a_varying_grid_is_unbiased(void **state)
{
    (void)state;
    enum { NX = 37, NY = 11, NZ = 5 };
    static float density[NX * NY * NZ];
    struct pt_rng rng = pt_rng_make(SEED);
    for (int i = 0; i < NX * NY * NZ; i++) {
        float u = pt_rng_float(&rng);
        density[i] = u < 0.5f ? 0.0f : 6.0f * u * u; /* half of it empty */
    }
    struct pt_arena arena = {0};
    pt_vec3 a = v3(0.2f, 0.0f, 1.0f), s = v3(1.0f, 0.3f, 0.5f);
    struct pt_medium m = grid(&arena, density, NX, NY, NZ, a, s);
    pt_vec3 o = v3(-0.4f, 0.1f, 0.2f), d = v3_norm(v3(1.0f, 0.45f, 0.3f));
    double depth = 0.0;
    enum { STEPS = 200000 };
    const double length = 2.0;
    for (int i = 0; i < STEPS; i++)
        depth += (double)pt_medium_density(&m, v3_madd(o, (float)(length * (i + 0.5) / STEPS), d)) * length / STEPS;
    double ratio[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < SAMPLES; i++) {
        pt_vec3 t = pt_medium_transmittance(&m, o, d, (float)length, &rng);
        ratio[0] += (double)t.x / SAMPLES, ratio[1] += (double)t.y / SAMPLES, ratio[2] += (double)t.z / SAMPLES;
    }
    struct tally t;
    run(&m, o, d, (float)length, SAMPLES, &t);
    for (int c = 0; c < 3; c++) {
        double st = (double)(c == 0   ? a.x + s.x
                             : c == 1 ? a.y + s.y
                                      : a.z + s.z),
               sc = (double)(c == 0   ? s.x
                             : c == 1 ? s.y
                                      : s.z);
        double expected = exp(-st * depth), scattered = sc / st * (1.0 - expected);
        const double tolerance = 6.0 / sqrt(SAMPLES);
        if (fabs(ratio[c] - expected) > tolerance || fabs(t.through[c] - expected) > tolerance ||
            fabs(t.scattered[c] - scattered) > tolerance)
            fail_msg("channel %d: expected %g, ratio %g, delta %g; scattered %g of %g", c, expected, ratio[c], t.through[c],
                     t.scattered[c], scattered);
    }
    pt_arena_release(&arena);
}

/* The majorant bounds the density everywhere: sampled points, borders included. */
static void majorant_bounds_the_density(void **state)
{
    (void)state;
    enum { NX = 33, NY = 1, NZ = 100 };
    static float density[NX * NY * NZ];
    struct pt_rng rng = pt_rng_make(SEED);
    for (int i = 0; i < NX * NY * NZ; i++)
        density[i] = pt_rng_float(&rng) < 0.1f ? 1.0f : 0.0f;
    struct pt_arena arena = {0};
    struct pt_medium m = grid(&arena, density, NX, NY, NZ, v3_splat(1.0f), v3_splat(0.0f));
    for (int i = 0; i < 300000; i++) {
        pt_vec3 p = v3(pt_rng_float(&rng), pt_rng_float(&rng), pt_rng_float(&rng));
        int x = (int)(p.x * (float)m.mx), y = (int)(p.y * (float)m.my), z = (int)(p.z * (float)m.mz);
        assert_true(pt_medium_density(&m, p) <= m.majorant[(z * m.my + y) * m.mx + x] + 1e-6f);
    }
    assert_true(pt_medium_density(&m, v3(-0.01f, 0.5f, 0.5f)) == 0.0f);
    pt_arena_release(&arena);
}

/* Where nothing is absorbed, a path that scatters or passes carries as much as before, all colours together, however often: none of
 * its samples is worth more than three times the mean. */
static void nothing_is_lost_or_won(void **state)
{
    (void)state;
    float density[1] = {1.0f};
    struct pt_arena arena = {0};
    const pt_vec3 scatter = {0.2f, 1.0f, 5.0f};
    struct pt_medium media[2] = {homogeneous(v3_splat(0.0f), scatter),
                                 grid(&arena, density, 1, 1, 1, v3_splat(0.0f), scatter)};
    for (int k = 0; k < 2; k++) {
        struct pt_rng rng = pt_rng_make(SEED);
        for (int i = 0; i < 100; i++) {
            pt_vec3 carried = v3_splat(1.0f);
            for (int step = 0; step < 50; step++) {
                struct pt_medium_event e;
                pt_medium_sample_distance(&media[k], v3_splat(0.5f), v3(1, 0, 0), 0.4f, carried, &rng, &e);
                carried = v3_mul(carried, e.weight);
                if (!(fabs((double)v3_mean(carried) - 1.0) < 1e-4))
                    fail_msg("medium %d carries %g %g %g", k, (double)carried.x, (double)carried.y, (double)carried.z);
            }
        }
    }
    pt_arena_release(&arena);
}

static void rays_that_miss_the_grid_pass(void **state)
{
    (void)state;
    float density[1] = {3.0f};
    struct pt_arena arena = {0};
    struct pt_medium m = grid(&arena, density, 1, 1, 1, v3_splat(1.0f), v3_splat(1.0f));
    struct pt_rng rng = pt_rng_make(SEED);
    const pt_vec3 origins[] = {{2, 0.5f, 0.5f}, {0.5f, -1, 0.5f}, {-1, 0.5f, 0.5f}};
    const pt_vec3 directions[] = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
    const float lengths[] = {INFINITY, INFINITY, 0.9f};
    for (int i = 0; i < 3; i++) {
        struct pt_medium_event e;
        pt_medium_sample_distance(&m, origins[i], directions[i], lengths[i], v3_splat(1.0f), &rng, &e);
        assert_true(!e.scattered && e.weight.x == 1.0f);
        assert_true(pt_medium_transmittance(&m, origins[i], directions[i], lengths[i], &rng).x == 1.0f);
    }
    /* along an edge and through a corner: no endless loop, finite */
    pt_vec3 t = pt_medium_transmittance(&m, v3_splat(-1.0f), v3_norm(v3_splat(1.0f)), 10.0f, &rng);
    assert_true(v3_is_finite(t) && t.x >= 0.0f && t.x <= 1.0f);
    pt_arena_release(&arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(absorption_is_beer_lambert),
        cmocka_unit_test(unbounded_glow_is_finite),
        cmocka_unit_test(homogeneous_sampling_is_unbiased),
        cmocka_unit_test(constant_grid_equals_homogeneous),
        cmocka_unit_test(tracking_through_a_varying_grid_is_unbiased),
        cmocka_unit_test(majorant_bounds_the_density),
        cmocka_unit_test(rays_that_miss_the_grid_pass),
        cmocka_unit_test(nothing_is_lost_or_won),
    };
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
