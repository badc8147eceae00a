/*
 * Samples inside a block leave no bias: every scene, and a kernel of rare bright samples, rendered with cells and with as many
 * samples everywhere. Both take the same first samples of each pixel, so that the pixels' differences are small; their mean
 * over a quarter of the picture and some seeds must look like noise. With k tests at family error rate 1e-4 the bound on |z|
 * is Šidák's. Weights that look at the samples that they share out (the rows' own, or those of the wave) fail the kernel.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glob.h>
#include <math.h>

#include "geom/accel.h"
#include "pbrt/load.h"
#include "support/pt_fake.h"

enum {
    SIDE = 16,
    CELL = 8,
    PARTS = 4,
    SPP = 48,
    SEEDS = 3,
    FAKE_SIDE = 32,
    FAKE_CELL = 8,
    FAKE_SPP = 32,
    FAKE_SEEDS = 2000
};

struct moments {
    double sum, sum2, n;
};

/* |z| that k independent tests exceed with probability 1e-4 altogether: bisection on erfc. */
static double sidak(int k)
{
    double p = -expm1(log1p(-1e-4) / k), lo = 0.0, hi = 40.0;
    for (int i = 0; i < 100; i++) {
        double z = 0.5 * (lo + hi);
        if (erfc(z / sqrt(2.0)) > p)
            lo = z;
        else
            hi = z;
    }
    return hi;
}

static double mean(const struct pt_render *r, size_t i, size_t c)
{
    const double spp = (double)pt_film_spp(&r->film, i, r->blocks->list[0].spp);
    return r->film.color[3 * i + c] / fmax(spp - r->film.dropped[i], 1.0);
}

/* Adds the differences of the pixels of two renders. */
static void add(const struct pt_render *a, const struct pt_render *b, struct moments parts[PARTS][3])
{
    for (size_t i = 0; i < a->film.pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            struct moments *m = &parts[i * PARTS / a->film.pixels][c];
            const double d = mean(a, i, c) - mean(b, i, c);
            m->sum += d;
            m->sum2 += d * d;
            m->n += 1.0;
        }
}

static struct pt_fake_run render(const struct pt_scene *scene, pt_kernel *kernel, const struct pt_render_config *config,
                                 struct base_threads *pool)
{
    const struct lull_pair pair = {"at", "1000"};
    const struct pt_render_hooks hooks = {0};
    struct pt_fake_run r = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, pool, NULL, &r.criterion, &err), 0);
    assert_int_equal(pt_render_create(config, scene, kernel, pool, r.criterion, &r.render, &err), 0);
    assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), 0);
    return r;
}

/* One block. */
static struct pt_render_config picture(int side, int cell, uint32_t spp, const struct pt_integrator *integrator)
{
    return (struct pt_render_config){.width = side,
                                     .height = side,
                                     .crop = {0, 0, side, side},
                                     .block_width = side,
                                     .block_height = side,
                                     .cell = cell,
                                     .spp_min = 8,
                                     .spp_max = spp,
                                     .integrator = *integrator};
}

/* Returns the largest |z|. */
static double compare(const struct pt_scene *scene, pt_kernel *kernel, const struct pt_render_config *with, uint32_t seeds,
                      struct base_threads *pool)
{
    struct moments parts[PARTS][3] = {0};
    double worst = 0.0;
    for (uint32_t seed = 0; seed < seeds; seed++) {
        struct pt_render_config config = *with;
        config.integrator.seed = seed;
        struct pt_fake_run cells = render(scene, kernel, &config, pool);
        config.cell = 0;
        struct pt_fake_run even = render(scene, kernel, &config, pool);
        add(cells.render, even.render, parts);
        pt_fake_release(&even);
        pt_fake_release(&cells);
    }
    for (int i = 0; i < PARTS; i++)
        for (int c = 0; c < 3; c++) {
            const struct moments *m = &parts[i][c];
            const double mean_of = m->sum / m->n, variance = m->sum2 / m->n - mean_of * mean_of;
            worst = fmax(worst, variance > 0.0 ? fabs(mean_of) / sqrt(variance / m->n) : 0.0);
        }
    return worst;
}

/* One sample in 24 is bright, the others are dark: what is skew makes a bias of looking at one's own samples. */
static void rare(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                 uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x + 1000 * settings->seed, y, count, sample, out);
    for (int i = 0; i < count; i++)
        out[i].radiance = v3_splat(2.0f * (out[i].radiance.x - 0.5f) < 1.0f / 24.0f ? 8.0f : 0.02f);
}

static void rare_bright_samples(void **state)
{
    (void)state;
    const struct pt_integrator integrator = {.max_component = INFINITY};
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(2, &err);
    const struct pt_render_config config = picture(FAKE_SIDE, FAKE_CELL, FAKE_SPP, &integrator);
    const double z = compare(NULL, rare, &config, FAKE_SEEDS, pool);
    if (z > sidak(3 * PARTS))
        fail_msg("a z-score of %.2f beyond %.2f", z, sidak(3 * PARTS));
    base_threads_destroy(pool);
}

static void every_scene(void **state)
{
    (void)state;
    glob_t found;
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(2, &err);
    assert_int_equal(glob("scenes/*.pbrt", 0, NULL, &found), 0);
    for (size_t i = 0; i < found.gl_pathc; i++) {
        const struct pt_load_options options = {.width = SIDE, .height = SIDE};
        const double bound = sidak(3 * PARTS * (int)found.gl_pathc);
        struct pt_scene_defaults defaults;
        struct pt_scene *scene = NULL;
        if (pt_scene_load(found.gl_pathv[i], &options, &scene, &defaults, &err) != 0)
            fail_msg("%s", err.text);
        const struct pt_render_config config = picture(SIDE, CELL, SPP, &defaults.integrator);
        const double z = compare(scene, pt_kernel_select(scene->effects, NULL, NULL), &config, SEEDS, pool);
        if (z > bound)
            fail_msg("%s: a z-score of %.2f beyond %.2f", found.gl_pathv[i], z, bound);
        pt_scene_destroy(scene);
    }
    assert_true(found.gl_pathc > 60);
    globfree(&found);
    base_threads_destroy(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rare_bright_samples), cmocka_unit_test(every_scene)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
