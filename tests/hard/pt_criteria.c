/*
 * The shipped cheap criteria inside the wave loop, on blocks that are entirely black, entirely constant, or have one firefly in
 * 10^5 samples: the first two stop at once with finite numbers, the last does not stop at the first check.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "render/host.h"
#include "support/pt_fake.h"

enum { BLOCK = 100, FIRST_CHECK = 32 };

static uint32_t mix(uint32_t v)
{
    v ^= v >> 16;
    v *= 0x7feb352du;
    v ^= v >> 15;
    v *= 0x846ca68bu;
    return v ^ v >> 16;
}

/* Block 0 black, block 1 constant, block 2 with fireflies on 0.2, block 3 infinite in one of 50 samples. */
static void four_blocks(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                        int count, uint32_t sample, struct pt_path_result *out)
{
    (void)scene, (void)settings;
    for (int i = 0; i < count; i++, x++, out++) {
        uint32_t h = mix(mix(mix(x + 1) + y) + sample);
        *out = (struct pt_path_result){.rays = 1};
        if (x >= 3 * BLOCK)
            out->radiance = h % 50 == 0 ? v3(INFINITY, 1, 1) : v3_splat(0.2f);
        else if (x >= 2 * BLOCK)
            out->radiance = v3_splat(h % 100000 == 0 ? 1e5f : 0.2f);
        else if (x >= BLOCK)
            out->radiance = v3(0.1f, 0.2f, 0.3f);
    }
}

static struct pt_render *render(const char *criterion_id, struct lull_host_criterion **criterion, struct base_threads *pool)
{
    struct pt_render_config config = {.width = 4 * BLOCK,
                                      .height = BLOCK,
                                      .crop = {0, 0, 4 * BLOCK, BLOCK},
                                      .block_width = BLOCK,
                                      .block_height = BLOCK,
                                      .spp_min = FIRST_CHECK,
                                      .spp_max = 2000,
                                      .integrator = {.max_component = INFINITY}};
    struct pt_render *r = NULL;
    struct pt_render_hooks hooks = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    const struct lull_criterion *table;
    if (pt_criterion_find(criterion_id, NULL, NULL, &table, &err) != 0 ||
        pt_criterion_create(table, NULL, 0, pool, NULL, criterion, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(pt_render_create(&config, NULL, four_blocks, pool, *criterion, &r, &err), 0);
    assert_int_equal(pt_render_run(r, &hooks, &outcome, &err), 0);
    assert_int_equal(r->totals->failed_checks, 0);
    return r;
}

static void special_blocks(void **state)
{
    static const char *const ids[] = {"halfbuf", "variance"};
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(2, &err);
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct lull_host_criterion *criterion = NULL;
        struct pt_render *r = render(ids[i], &criterion, pool);
        const struct lull_host_block *b = r->blocks->list;
        int broken = 0;
        for (size_t k = 0; k < 3 * r->film.pixels; k++)
            broken += !isfinite(r->film.color[k]);
        printf("# figure infinite: %d values of %zu are no number\n", broken, 3 * r->film.pixels);
        assert_int_equal(broken, 0);
        for (int k = 0; k < 2; k++) {
            assert_int_equal(b[k].reason, LULL_REASON_CRITERION);
            assert_int_equal(b[k].spp, FIRST_CHECK);
            assert_true(b[k].error >= 0.0 && b[k].error < 1e-6);
        }
        assert_true(b[2].spp > FIRST_CHECK);
        assert_true(isfinite(b[2].error));
        assert_int_equal(b[3].reason, LULL_REASON_DROPPED);
        assert_true(isfinite(b[3].error));
        pt_render_destroy(r);
        lull_host_close(criterion);
    }
    base_threads_destroy(pool);
}

/* 10^6 samples per pixel through the whole loop: the mean is exact to 10^-6. */
static void million_samples(void **state)
{
    struct pt_render_config config = {.width = 2,
                                      .height = 1,
                                      .crop = {0, 0, 2, 1},
                                      .block_width = 16,
                                      .block_height = 16,
                                      .spp_min = 1000000,
                                      .spp_max = 1000000,
                                      .uniform = 1,
                                      .planes = PT_FILM_ALL,
                                      .integrator = {.max_component = INFINITY}};
    struct pt_render *r = NULL;
    struct pt_render_hooks hooks = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(2, &err);
    double rgb[3];
    (void)state;
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_constant, pool, NULL, &r, &err), 0);
    assert_int_equal(pt_render_run(r, &hooks, &outcome, &err), 0);
    pt_film_mean(&r->film, 1, 1000000, rgb);
    printf("# figure million: off by %.2g\n", fmax(fabs(rgb[0] / (double)0.1f - 1.0), fabs(rgb[2] / (double)0.3f - 1.0)));
    assert_true(fabs(rgb[0] / (double)0.1f - 1.0) < 1e-6);
    assert_true(fabs(rgb[2] / (double)0.3f - 1.0) < 1e-6);
    assert_true(fabs(r->film.depth[1] - 2.0) < 1e-6);
    pt_render_destroy(r);
    base_threads_destroy(pool);
}

int main(void)
{
    char path[4096];
    const char *build = getenv("BUILD");
    snprintf(path, sizeof path, "%s/lib/lull", build ? build : "build");
    setenv("LULL_PLUGIN_PATH", path, 1);
    const struct CMUnitTest tests[] = {cmocka_unit_test(special_blocks), cmocka_unit_test(million_samples)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
