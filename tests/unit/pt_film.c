#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include <lull/criterion_kit.h>

#include "host/frame.h"
#include "render/host.h"

static struct pt_path_result sample_of(float r, float g, float b)
{
    return (struct pt_path_result){
        .radiance = v3(r, g, b), .albedo = v3_splat(0.5f), .normal_world = v3(0, 1, 0), .depth = 3.0f};
}

static void half_is_balanced(void **state)
{
    (void)state;
    uint64_t in_half = 0;
    for (uint32_t s = 0; s < 100000; s++) {
        assert_int_equal(pt_film_half_spp(s), in_half);
        in_half += (uint64_t)pt_film_in_half(s);
    }
}

static void planes_on_demand(void **state)
{
    (void)state;
    struct pt_film film;
    struct base_err err = {0};
    assert_int_equal(pt_film_init(&film, 0, 0, 10, 10, PT_FILM_COLOR, &err), 0);
    assert_null(film.half);
    assert_null(film.moment2);
    assert_null(film.albedo);
    assert_int_equal(film.bytes, 100 * pt_film_pixel_bytes(PT_FILM_COLOR));
    pt_film_release(&film);
    assert_in_range(pt_film_pixel_bytes(PT_FILM_ALL), 1, 200);
}

static void sums_survive_load_and_store(void **state)
{
    (void)state;
    struct pt_film film;
    struct pt_film_pixel p;
    struct base_err err = {0};
    double mean[3];
    assert_int_equal(pt_film_init(&film, 5, 6, 9, 9, PT_FILM_ALL, &err), 0);
    size_t i = pt_film_index(&film, 7, 8);
    for (uint32_t s = 0; s < 64; s++) {
        struct pt_path_result r = sample_of((float)s, 1.0f, 2.0f);
        pt_film_load(&film, i, &p);
        assert_true(pt_film_add(&p, film.planes, pt_film_in_half(s), &r));
        pt_film_store(&film, i, &p);
    }
    pt_film_mean(&film, i, 64, mean);
    assert_true(mean[0] == 31.5 && mean[1] == 1.0 && mean[2] == 2.0);
    assert_true(film.half[3 * i + 1] == 32.0);
    assert_true(film.albedo[3 * i] == 32.0 && film.normal[3 * i + 1] == 64.0 && film.depth[i] == 3.0);
    assert_int_equal(film.depth_hits[i], 64);
    double y = base_luminance(0, 1, 2), all = 0.0;
    for (int s = 0; s < 64; s++)
        all += (y + BASE_LUMINANCE_R * s) * (y + BASE_LUMINANCE_R * s);
    assert_true(fabs(film.moment2[i] - all) < 1e-9 * all);
    pt_film_release(&film);
}

/* 10^6 samples of a value that is no dyadic fraction: the mean must not drift. */
static void million_samples_of_a_constant(void **state)
{
    (void)state;
    struct pt_film_pixel p = {0};
    struct pt_path_result r = sample_of(0.1f, 1234.567f, 1e-5f);
    for (uint32_t s = 0; s < 1000000; s++)
        pt_film_add(&p, PT_FILM_ALL, pt_film_in_half(s), &r);
    const float *expected = &r.radiance.x;
    for (int c = 0; c < 3; c++) {
        assert_true(fabs(p.color[c] / 1e6 / (double)expected[c] - 1.0) < 1e-6);
        assert_true(fabs(p.half[c] / 5e5 / (double)expected[c] - 1.0) < 1e-6);
    }
}

static void non_finite_samples_are_dropped(void **state)
{
    (void)state;
    struct pt_film film;
    struct pt_film_pixel p;
    struct base_err err = {0};
    double mean[3];
    assert_int_equal(pt_film_init(&film, 0, 0, 2, 1, PT_FILM_ALL, &err), 0);
    pt_film_load(&film, 1, &p);
    for (uint32_t s = 0; s < 32; s++) {
        struct pt_path_result r = sample_of(s % 4 == 1 ? NAN : 2.0f, s % 8 == 3 ? -INFINITY : 2.0f, 2.0f);
        assert_int_equal(pt_film_add(&p, film.planes, pt_film_in_half(s), &r), s % 4 != 1 && s % 8 != 3);
    }
    pt_film_store(&film, 1, &p);
    assert_int_equal(film.dropped[1], 12);
    pt_film_mean(&film, 1, 32, mean);
    assert_true(mean[0] == 2.0 && mean[1] == 2.0);
    pt_film_release(&film);
}

/* To the last bit, whatever was dropped: a recording's codes come from the one, a network's from the other. */
static void a_criterion_reads_the_mean(void **state)
{
    (void)state;
    enum { PIXELS = 3000 };
    struct pt_film film;
    struct base_err err = {0};
    double want[PIXELS][3], want_half[PIXELS][3], got[PIXELS][3];
    const uint64_t spp = 5347, half_spp = pt_film_half_spp(spp);
    assert_int_equal(pt_film_init(&film, 0, 0, PIXELS, 1, PT_FILM_COLOR | PT_FILM_HALF, &err), 0);
    for (int dropped = 0; dropped < 2; dropped++) {
        for (size_t i = 0; i < PIXELS; i++) {
            for (size_t c = 0; c < 3; c++) {
                film.color[3 * i + c] = (double)spp * fabs(sin((double)(3 * i + c)));
                film.half[3 * i + c] = (double)half_spp * fabs(cos((double)(3 * i + c)));
            }
            film.dropped[i] = (uint32_t)(i % 8 < 4 || !dropped ? 0 : i);
            film.dropped_half[i] = film.dropped[i] / 3;
            pt_film_mean(&film, i, spp, want[i]);
            pt_film_half_mean(&film, i, half_spp, want_half[i]);
        }
        struct lull_host_block list = {
            .x1 = PIXELS, .y1 = 1, .spp = spp, .half_spp = half_spp, .dropped = (uint64_t)dropped};
        struct lull_host_blocks blocks = {.count = 1, .list = &list, .x1 = PIXELS, .y1 = 1};
        struct pt_host_view film_view;
        struct lull_host_shown shown;
        pt_host_show(&film, &film_view);
        assert_int_equal(lull_host_show(&blocks, &film_view.view, 0, &shown, NULL), LULL_OK);
        assert_int_equal(shown.planes[LULL_PLANE_COLOR].normaliser, dropped ? LULL_NORM_WEIGHT : LULL_NORM_SPP);
        const struct lull_view view = {.struct_size = sizeof view,
                                       .x1 = PIXELS,
                                       .y1 = 1,
                                       .planes = shown.planes,
                                       .plane_count = LULL_PLANE_COUNT,
                                       .plane_stride = sizeof shown.planes[0]};
        const struct lull_block block = {.x1 = PIXELS, .y1 = 1, .spp = spp, .half_spp = half_spp};
        lull_kit_read(&view, &shown.planes[LULL_PLANE_COLOR], &block, 0, 0, PIXELS, 3, got);
        assert_memory_equal(got, want, sizeof got);
        lull_kit_read(&view, &shown.planes[LULL_PLANE_HALF], &block, 0, 0, PIXELS, 3, got);
        assert_memory_equal(got, want_half, sizeof got);
        lull_host_hide(&shown);
    }
    pt_film_release(&film);
}

/* Most that is dropped is of one half: each half's mean is that of what it kept. */
static void halves_drop_apart(void **state)
{
    (void)state;
    struct pt_film film;
    struct pt_film_pixel p;
    struct base_err err = {0};
    enum { SPP = 40 };
    double sum[3] = {0}, kept[3] = {0}, mean[3]; /* whole, half A, half B */
    assert_int_equal(pt_film_init(&film, 3, 0, 5, 1, PT_FILM_ALL, &err), 0);
    pt_film_load(&film, 1, &p);
    for (uint32_t s = 0; s < SPP; s++) {
        int half = pt_film_in_half(s) ? 1 : 2, bad = half == 1 ? (int)(s / 2 % 2) : s == 9;
        struct pt_path_result r = sample_of(bad ? NAN : (float)s, 1.0f, 1.0f);
        pt_film_add(&p, film.planes, pt_film_in_half(s), &r);
        for (int k = 0; !bad && k < 3; k++)
            if (k == 0 || k == half) {
                sum[k] += s;
                kept[k] += 1.0;
            }
    }
    pt_film_store(&film, 1, &p);
    uint64_t half_spp = pt_film_half_spp(SPP);
    assert_true(kept[1] < kept[2] && kept[1] + kept[2] == kept[0]);
    assert_true(film.dropped[1] == SPP - kept[0] && film.dropped_half[1] == (double)half_spp - kept[1]);
    pt_film_mean(&film, 1, SPP, mean);
    assert_true(fabs(mean[0] - sum[0] / kept[0]) < 1e-12);
    pt_film_half_mean(&film, 1, half_spp, mean);
    assert_true(fabs(mean[0] - sum[1] / kept[1]) < 1e-12);
    pt_film_release(&film);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_is_balanced),
        cmocka_unit_test(planes_on_demand),
        cmocka_unit_test(sums_survive_load_and_store),
        cmocka_unit_test(million_samples_of_a_constant),
        cmocka_unit_test(non_finite_samples_are_dropped),
        cmocka_unit_test(halves_drop_apart),
        cmocka_unit_test(a_criterion_reads_the_mean),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
