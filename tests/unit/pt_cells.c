/* Samples inside a block: what cells are given, and renders with them: the same bytes always, halves that stay halves. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "host/frame.h"
#include "render/cells.h"
#include "render/checkpoint.h"
#include "render/host_planes.h"
#include "support/pt_fake.h"

enum { SIDE = 64, CELL = 16 };

static unsigned char scratch[1 << 16];

/* Noise of so much in every pixel of [x0, x1) x [y0, y1) whose row's parity is given, -1: any. */
static void make_noise(struct pt_film *film, int x0, int y0, int x1, int y1, int parity, double noise)
{
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) {
            const size_t i = pt_film_index(film, x, y);
            const double half = film->spp[i] / 2.0, sign = (x + y) % 2 ? 1.0 : -1.0;
            for (size_t c = 0; c < 3 && (parity < 0 || y % 2 == parity); c++) {
                film->color[3 * i + c] = 0.4 * film->spp[i];
                film->half[3 * i + c] = (0.4 + sign * noise) * half;
            }
        }
}

/* A block of grey with the noise of `quiet` everywhere, after a first wave of 16. */
static struct pt_film quiet_film(double quiet)
{
    struct pt_film film;
    struct base_err err = {0};
    assert_int_equal(pt_film_init(&film, 0, 0, SIDE, SIDE, PT_FILM_HALF | PT_FILM_SPP, &err), 0);
    for (size_t i = 0; i < film.pixels; i++)
        film.spp[i] = film.goal[i] = 16;
    make_noise(&film, 0, 0, SIDE, SIDE, -1, quiet);
    return film;
}

static struct pt_cells_wave wave_to(uint32_t to) { return (struct pt_cells_wave){0, 0, SIDE, SIDE, CELL, to}; }

static void plan(struct pt_film *film, uint32_t to)
{
    const struct pt_cells_wave wave = wave_to(to);
    assert_in_range(pt_cells_scratch(SIDE, SIDE, CELL), 1, sizeof scratch);
    pt_cells_plan(film, &wave, scratch);
}

static uint32_t goal_at(const struct pt_film *film, int x, int y) { return film->goal[pt_film_index(film, x, y)]; }

static double mean_goal(const struct pt_film *film)
{
    double sum = 0.0;
    for (size_t i = 0; i < film->pixels; i++)
        sum += film->goal[i];
    return sum / (double)film->pixels;
}

static void assert_bounds(const struct pt_film *film, uint32_t to)
{
    for (size_t i = 0; i < film->pixels; i++) {
        assert_int_equal(film->goal[i] % PT_CELLS_STEP, 0);
        assert_true(film->goal[i] >= film->spp[i] && 2 * film->goal[i] >= to && film->goal[i] <= 4 * to);
    }
    assert_true(fabs(mean_goal(film) - to) <= PT_CELLS_STEP * CELL * CELL / 2.0 / (SIDE * SIDE));
}

static void without_noise_all_get_the_same(void **state)
{
    (void)state;
    const double noises[] = {0.0, 0.02};
    for (int k = 0; k < 2; k++) {
        struct pt_film film = quiet_film(noises[k]);
        plan(&film, 40);
        for (size_t i = 0; i < film.pixels; i++)
            assert_int_equal(film.goal[i], 40);
        pt_film_release(&film);
    }
}

/* One cell of 16 with ever more noise: its share is a power of two of that of the others, by sigma^(3/4). */
static void weights_are_powers_of_two(void **state)
{
    (void)state;
    static const struct {
        double noise;
        int ratio;
    } row[] = {{0.001, 1}, {0.0011, 1}, {0.0026, 2}, {0.007, 4}};
    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        struct pt_film film = quiet_film(0.001);
        make_noise(&film, 32, 16, 48, 32, -1, row[k].noise);
        plan(&film, 1 << 20);
        const double ratio = (double)goal_at(&film, 40, 20) / goal_at(&film, 0, 0);
        assert_true(fabs(ratio / row[k].ratio - 1.0) < 1e-4);
        assert_bounds(&film, 1 << 20);
        pt_film_release(&film);
    }
}

/* As much noise as can be: four times the mean, and the others share the rest. */
static void no_cell_takes_all(void **state)
{
    (void)state;
    struct pt_film film = quiet_film(0.001);
    make_noise(&film, 32, 16, 48, 32, -1, 0.3);
    plan(&film, 1 << 20);
    assert_int_equal(goal_at(&film, 40, 20), 4 << 20);
    assert_true(fabs((double)goal_at(&film, 0, 0) / (1 << 20) - 12.0 / 15.0) < 1e-4);
    assert_bounds(&film, 1 << 20);
    pt_film_release(&film);
}

static void bounds_hold_from_wave_to_wave(void **state)
{
    (void)state;
    struct pt_film film = quiet_film(0.001);
    for (uint32_t to = 24, wave = 0; to < 4000; to = to * 3 / 16 * 8, wave++) {
        int at = (int)(wave % 4) * CELL; /* the noise moves about */
        make_noise(&film, 0, 0, SIDE, SIDE, -1, 0.001);
        make_noise(&film, at, 0, at + CELL, SIDE - at, -1, 0.05);
        plan(&film, to);
        assert_bounds(&film, to);
        memcpy(film.spp, film.goal, film.pixels * sizeof *film.spp);
    }
    pt_film_release(&film);
}

/* What the samples of a row were does not decide how many it gets: the rows between do. */
static void rows_are_told_by_the_others(void **state)
{
    (void)state;
    for (int parity = 0; parity < 2; parity++) {
        struct pt_film film = quiet_film(0.001);
        make_noise(&film, 16, 16, 32, 32, parity, 0.05);
        plan(&film, 4096);
        const int own = (int)goal_at(&film, 20, 20 + parity), quiet = (int)goal_at(&film, 60, 60);
        assert_true(abs(own - quiet) <= PT_CELLS_STEP); /* a step may be left over */
        assert_true(goal_at(&film, 20, 21 - parity) > 4 * goal_at(&film, 60, 60));
        pt_film_release(&film);
    }
}

/* Noise that a display does not show counts as none. */
static void white_has_no_noise(void **state)
{
    (void)state;
    struct pt_film film = quiet_film(0.001);
    make_noise(&film, 16, 16, 32, 32, -1, 0.05);
    for (int y = 16; y < 32; y++)
        for (int x = 16; x < 32; x++)
            for (size_t c = 0; c < 3; c++) {
                film.color[3 * pt_film_index(&film, x, y) + c] += 16 * 5.0;
                film.half[3 * pt_film_index(&film, x, y) + c] += 8 * 5.0;
            }
    plan(&film, 4096);
    assert_true(goal_at(&film, 20, 20) < goal_at(&film, 60, 60));
    pt_film_release(&film);
}

static void a_wave_under_way_stays(void **state)
{
    (void)state;
    struct pt_film film = quiet_film(0.001);
    make_noise(&film, 16, 16, 32, 32, -1, 0.05);
    plan(&film, 64);
    const uint32_t quiet = goal_at(&film, 0, 0), noisy = goal_at(&film, 20, 20);
    make_noise(&film, 0, 0, 16, 16, -1, 0.9);
    plan(&film, 128);
    assert_true(goal_at(&film, 0, 0) == quiet && goal_at(&film, 20, 20) == noisy);
    memcpy(film.spp, film.goal, film.pixels * sizeof *film.spp);
    plan(&film, 128);
    assert_true(goal_at(&film, 0, 0) > quiet);
    pt_film_release(&film);
}

/* Whatever the steps on the way. */
static void a_pixel_gets_there(void **state)
{
    (void)state;
    const uint32_t to = 160;
    for (uint32_t goal = 80; goal <= 640; goal += 40)
        for (uint32_t step = PT_CELLS_STEP; step <= to; step += PT_CELLS_STEP) {
            uint32_t spp = 64;
            for (uint32_t now = 40; now < to; now += step) {
                spp = pt_cells_reach(spp, goal, now, to);
                assert_int_equal(spp, pt_cells_reach(64, goal, now, to));
                assert_true(spp >= 64 && spp % PT_CELLS_STEP == 0 && spp < (goal > 64 ? goal : 65));
            }
            assert_int_equal(pt_cells_reach(spp, goal, to, to), goal);
        }
    for (uint64_t n = 0; n < 100000; n += PT_CELLS_STEP)
        assert_int_equal(2 * pt_film_half_spp(n), n);
}

/* --- renders ---------------------------------------------------------------------------------------------------------- */

/* pt_fake_nan, whose noise is a fifth right of x = 24. */
static void uneven_noise(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                         int count, uint32_t sample, struct pt_path_result *out)
{
    pt_fake_nan(scene, settings, x, y, count, sample, out);
    for (int i = 0; i < count; i++)
        if (x + (uint32_t)i >= 24)
            out[i].radiance.x = 0.75f + 0.2f * (out[i].radiance.x - 0.75f);
}

static struct pt_render_config with_cells(void)
{
    struct pt_render_config config = pt_fake_config();
    config.planes = PT_FILM_ALL;
    config.cell = 4;
    return config;
}

/* Of every block: its pixels' samples are in steps, in the bounds, and their mean is the block's; and so are the totals. */
static int check_samples(const struct pt_render *r)
{
    uint64_t all = 0;
    int differ = 0;
    for (uint32_t k = 0; k < r->blocks->count; k++) {
        const struct lull_host_block *b = &r->blocks->list[k];
        uint64_t sum = 0;
        for (int y = b->y0; y < b->y1; y++)
            for (int x = b->x0; x < b->x1; x++) {
                const uint32_t spp = r->film.spp[pt_film_index(&r->film, x, y)];
                assert_true(spp % PT_CELLS_STEP == 0 && 2 * spp >= b->spp && spp <= 4 * b->spp);
                differ |= spp != b->spp;
                sum += spp;
            }
        const double mean = (double)sum / ((b->x1 - b->x0) * (b->y1 - b->y0));
        assert_true(fabs(mean - (double)b->spp) <= 1.0);
        all += sum;
    }
    assert_int_equal(r->totals->samples, all);
    return differ;
}

static void same_bytes_for_any_threads_and_order(void **state)
{
    (void)state;
    struct pt_render_config config = with_cells();
    config.max_seam = 1.5;
    struct pt_fake_run one = pt_fake_render(&config, uneven_noise, 1, "50");
    assert_true(check_samples(one.render));
    const int threads[] = {2, 3, 8, 3};
    for (int i = 0; i < 4; i++) {
        config.order_seed = i < 3 ? 0 : 99;
        struct pt_fake_run other = pt_fake_render(&config, uneven_noise, threads[i], "50");
        pt_fake_assert_same(one.render, other.render);
        pt_fake_release(&other);
    }
    pt_fake_release(&one);
}

static void another_kernel_run(struct pt_fake_run *r, const struct pt_render_config *config)
{
    struct base_err err = {0};
    struct lull_pair pair = {"at", "50"};
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r->pool, NULL, &r->criterion, &err), 0);
    assert_int_equal(pt_render_create(config, NULL, uneven_noise, r->pool, r->criterion, &r->render, &err), 0);
}

/* Ended by a pilot in the middle of a wave, or between two, saved, loaded into a new render and finished. */
static void resumed_render_is_identical(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_cells_test_XXXXXX";
    close(mkstemp(path));
    const struct pt_render_config config = with_cells();
    const struct pt_render_hooks none = {0};
    struct pt_fake_run whole = pt_fake_render(&config, uneven_noise, 2, "50");
    int in_a_wave = 0;
    for (uint64_t spp = 4; spp < 150; spp += 12) {
        struct pt_render_config pilot = config;
        enum pt_render_outcome outcome;
        struct base_err err = {0};
        struct pt_fake_run r = {.pool = base_threads_create(2, &err)};
        pilot.pilot_spp = spp;
        pilot.pilot_s = 1e9;
        another_kernel_run(&r, &pilot);
        assert_int_equal(pt_render_run(r.render, &none, &outcome, &err), 0);
        assert_int_equal(outcome, PT_RENDER_PILOT);
        const struct pt_film *f = &r.render->film;
        uint64_t samples = 0;
        for (size_t i = 0; i < f->pixels; i++) {
            assert_true(f->spp[i] > 0 && f->spp[i] % PT_CELLS_STEP == 0);
            samples += f->spp[i];
            in_a_wave += f->spp[i] > f->goal[i] / 2 && f->spp[i] < f->goal[i];
        }
        assert_int_equal(r.render->totals->samples, samples);
        assert_int_equal(pt_checkpoint_save(path, r.render, "a=1\n", &err), 0);
        pt_render_destroy(r.render);
        lull_host_close(r.criterion);
        another_kernel_run(&r, &config);
        assert_int_equal(pt_checkpoint_load(path, r.render, "a=1\n", &err), 0);
        assert_int_equal(pt_render_run(r.render, &none, &outcome, &err), 0);
        pt_fake_assert_same(whole.render, r.render);
        pt_fake_release(&r);
    }
    assert_true(in_a_wave > 0);
    pt_fake_release(&whole);
    unlink(path);
}

/* A criterion reads the means of pixels and of their halves, dropped samples or not; so does the image. */
static void means_are_those_of_the_pixels(void **state)
{
    (void)state;
    const struct pt_render_config config = with_cells();
    struct pt_fake_run r = pt_fake_render(&config, uneven_noise, 2, "50");
    const struct pt_film *f = &r.render->film;
    struct pt_host_view show;
    struct lull_host_shown s;
    assert_true(r.render->totals->dropped > 0);
    assert_int_equal(lull_host_show(r.render->blocks, pt_host_show(f, r.render->blocks, &show), 0, &s, NULL), LULL_OK);
    const struct lull_plane *half = &s.planes[LULL_PLANE_HALF], *weight = &s.planes[LULL_PLANE_WEIGHT];
    assert_true(half->normaliser == LULL_NORM_WEIGHT && s.planes[LULL_PLANE_COLOR].normaliser == LULL_NORM_WEIGHT);
    for (size_t i = 0; i < f->pixels; i++) {
        const double kept = ((const uint32_t *)weight->data)[i], n = f->spp[i];
        assert_true(kept == n - f->dropped[i]);
        double mean[3];
        pt_film_half_mean(f, i, f->spp[i] / 2, mean);
        for (size_t c = 0; c < 3; c++)
            assert_true(fabs(((const double *)half->data)[3 * i + c] * half->scale / kept - mean[c]) < 1e-12);
    }
    lull_host_hide(&s);
    for (uint32_t k = 0; k < r.render->blocks->count; k++)
        assert_true(fabs(r.render->blocks->list[k].error - 0.75) < 0.02);
    pt_fake_release(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_noise_all_get_the_same),
        cmocka_unit_test(weights_are_powers_of_two),
        cmocka_unit_test(no_cell_takes_all),
        cmocka_unit_test(bounds_hold_from_wave_to_wave),
        cmocka_unit_test(rows_are_told_by_the_others),
        cmocka_unit_test(white_has_no_noise),
        cmocka_unit_test(a_wave_under_way_stays),
        cmocka_unit_test(a_pixel_gets_there),
        cmocka_unit_test(same_bytes_for_any_threads_and_order),
        cmocka_unit_test(resumed_render_is_identical),
        cmocka_unit_test(means_are_those_of_the_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
