/*
 * The difference between the halves stands for the error of the mean: with either sampler it must be of that size.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "render/film.h"
#include "scene/scene.h"
#include "support/pt_scenes.h"

enum { SIZE = 24, SPP = 128, REFERENCE_SPP = 2048 };

static double luminance(const double *rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void sample(const struct pt_scene *scene, const struct pt_integrator *settings, pt_kernel *kernel, uint32_t spp,
                   struct pt_film *film)
{
    struct base_err err = {0};
    assert_int_equal(pt_film_init(film, 0, 0, SIZE, SIZE, PT_FILM_HALF, &err), 0);
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++) {
            struct pt_film_pixel p;
            size_t i = pt_film_index(film, x, y);
            pt_film_load(film, i, &p);
            for (uint32_t s = 0; s < spp; s++) {
                struct pt_path_result r;
                kernel(scene, settings, (uint32_t)x, (uint32_t)y, 1, s, &r);
                pt_film_add(&p, film->planes, pt_film_in_half(s), &r);
            }
            pt_film_store(film, i, &p);
        }
}

/* Medians, because a few pixels at the light's edge dominate a mean square: |D| = |A - B|/2 over the true error, of luminance. */
static double ratio(int32_t sampler)
{
    struct pt_scene scene;
    struct pt_film film, reference;
    test_cornell(&scene, SIZE, 1.0f, v3(0, 0, 0));
    struct pt_integrator settings = test_integrator(4);
    pt_kernel *kernel = pt_kernel_select(scene.effects, NULL, NULL);
    settings.sampler = sampler;
    settings.seed = 11;
    sample(&scene, &settings, kernel, SPP, &film);
    settings.seed = 77;
    settings.sampler = PT_SAMPLER_SOBOL;
    sample(&scene, &settings, kernel, REFERENCE_SPP, &reference);
    static double noise[SIZE * SIZE], error[SIZE * SIZE];
    for (size_t i = 0; i < film.pixels; i++) {
        double m[3], a[3], r[3];
        pt_film_mean(&film, i, SPP, m);
        pt_film_half_mean(&film, i, pt_film_half_spp(SPP), a);
        pt_film_mean(&reference, i, REFERENCE_SPP, r);
        double d = luminance(a) - luminance(m), e = luminance(m) - luminance(r);
        noise[i] = fabs(d);
        error[i] = fabs(e);
    }
    qsort(noise, film.pixels, sizeof noise[0], ascending);
    qsort(error, film.pixels, sizeof error[0], ascending);
    double d = noise[film.pixels / 2], e = error[film.pixels / 2];
    print_message("sampler %d: median of |D| %.5f, of the error %.5f\n", sampler, d, e);
    pt_film_release(&film);
    pt_film_release(&reference);
    test_scene_end(&scene);
    return d / e;
}

static void independent(void **state)
{
    (void)state;
    double q = ratio(PT_SAMPLER_INDEPENDENT);
    assert_true(q > 0.85 && q < 1.15);
}

static void sobol(void **state)
{
    (void)state;
    double q = ratio(PT_SAMPLER_SOBOL);
    assert_true(q > 0.85 && q < 1.15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(independent), cmocka_unit_test(sobol)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
