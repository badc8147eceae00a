/*
 * The criterion `denoised` with Open Image Denoise itself, on pictures that are known without noise: what is seen of the
 * blend's error where it stops. Crop and blocks lie off the denoiser's grid of 16 pixels. Without the library this is skipped;
 * tests/abi/api_denoised.c has a stub.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "render/output.h"
#include "render/host.h"

enum { W = 100, H = 90, BLOCK = 37, SPP_MAX = 8192 };

static const double LEVEL = 0.26183516668240014; /* ggn/sight/observer.json */

/* --- pictures ---------------------------------------------------------------------------------------------------------- */

static uint32_t mix(uint32_t v)
{
    v ^= v >> 16;
    v *= 0x7feb352du;
    v ^= v >> 15;
    v *= 0x846ca68bu;
    return v ^ v >> 16;
}

/* (0, 1], one after the other from a state. */
static double next(uint32_t *state) { return ((double)(*state = mix(*state + 0x9e3779b9u)) + 1.0) * 0x1p-32; }

static double checker(double x, double y) { return ((int)floor(x / 3) + (int)floor(y / 3)) & 1 ? 0.5 : 0.2; }

/* What one sample meets: the surface's albedo, and light on it that is 1 in the mean. */
struct met {
    double albedo, light;
};

/* u: three random numbers; x, y: of the pixel. */
typedef struct met meeting(double x, double y, const double u[3]);

static struct met stripes(double x, double y, const double u[3])
{
    (void)y;
    return (struct met){0.5, (fmod(x, 6) < 3 ? 0.62 : 0.58) * -log(u[0])};
}

static struct met defocus(double x, double y, const double u[3])
{
    const double r = 5 * sqrt(u[1]), angle = 6.283185307179586 * u[2];
    return (struct met){checker(x + r * cos(angle), y + 0.5 * r * sin(angle)), -log(u[0])};
}

static struct met motion(double x, double y, const double u[3])
{
    return (struct met){checker(x + 7 * u[1], y + u[1]), -log(u[0])};
}

static struct met fog(double x, double y, const double u[3])
{
    if (u[1] < 0.7)
        return (struct met){1, 0.35 * -log(u[0])};
    return (struct met){checker(x, y), 1.4 * -log(u[0])};
}

static struct met black(double x, double y, const double u[3])
{
    (void)x, (void)y, (void)u;
    return (struct met){0.5, 0};
}

static struct met white(double x, double y, const double u[3])
{
    (void)x, (void)y;
    return (struct met){1, 1e6 * (0.5 + u[0])};
}

/* Grey with little noise; the kernel adds one sample that has met the sun. */
static struct met hot(double x, double y, const double u[3])
{
    (void)x, (void)y;
    return (struct met){0.4, 1 - 0.2 * (1 + log(u[0]))};
}

/* Under defocus and motion albedo is noisy, and both halves are denoised with the same: that part of their error is common
 * to them and to the noise that they are held against. What is believed is too low then; two looks in a row see it in most
 * blocks all the same by estimates below zero. A first look stops only what is far below the limit, which these never are: by
 * 0.8 of the limit alone defocus and motion stopped at 64 samples with twice what is just seen. */
static const struct subject {
    const char *name;
    meeting *meet;
    double seen;          /* what may be left where a block stops; 1 is just seen */
    double kept;          /* what may be left where none stops it: of a sample of 10^6 a grey point */
    uint64_t least, most; /* samples at which a block stops */
} subjects[] = {{"stripes", stripes, 1.1, 3, 256, SPP_MAX}, {"defocus", defocus, 2, 3, 100, SPP_MAX},
                {"motion", motion, 2, 3, 80, SPP_MAX},      {"fog", fog, 1.1, 3, 64, SPP_MAX},
                {"black", black, 0.01, 3, 64, 64},          {"white", white, 0.01, 3, 64, 64},
                {"hot", hot, 1.1, 4.5, 64, SPP_MAX}};

static const struct subject *subject;

static void kernel(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                   uint32_t sample, struct pt_path_result *out)
{
    (void)scene, (void)settings;
    for (int i = 0; i < count; i++, x++, out++) {
        uint32_t state = mix(mix(mix(x + 1) + y) + sample);
        const double u[3] = {next(&state), next(&state), next(&state)};
        struct met m = subject->meet(x, y, u);
        if (subject->meet == hot && x == 50 && y == 40 && sample == 9)
            m.light = 1e6;
        *out = (struct pt_path_result){.radiance = v3_splat((float)(m.albedo * m.light)),
                                       .albedo = v3_splat((float)m.albedo),
                                       .normal_world = v3(0, 0, 1),
                                       .depth = 1,
                                       .rays = 1};
    }
}

/* --- what is seen ------------------------------------------------------------------------------------------------------ */

static double lightness(double y)
{
    y = y < 1 ? y : 1;
    return y > 216.0 / 24389 ? 116 * cbrt(y) - 16 : 24389.0 / 27 * y;
}

/* The picture without noise, in L*. */
static double truth[H][W];

static void know(void)
{
    enum { N = 987, TURN = 610 }; /* Fibonacci numbers: even in both dimensions */
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++) {
            double sum = 0;
            for (int i = 0; i < N; i++) {
                const double u[3] = {0.36787944117144233, (i + 0.5) / N, (i * TURN % N + 0.5) / N};
                const struct met m = subject->meet(x, y, u); /* light for its mean: -log(1/e) is 1 */
                sum += m.albedo * m.light / N;
            }
            truth[y][x] = lightness(sum);
        }
}

static double at(double map[H][W], const struct lull_host_block *b, int x, int y)
{
    x = x < b->x0 ? b->x0 : x < b->x1 ? x : b->x1 - 1;
    y = y < b->y0 ? b->y0 : y < b->y1 ? y : b->y1 - 1;
    return map[y][x];
}

/* ggn/sight/visibility.h on one patch: 1 is just seen. */
static double visible(const struct lull_host_block *b, const struct pt_film *film, const float *rgb)
{
    static const double blur[] = {0.009620057, 0.205423697, 0.569912492, 0.205423697, 0.009620057};
    static double error[H][W];
    double sixth = 0, texture = 0;
    const int n = (b->x1 - b->x0) * (b->y1 - b->y0);
    for (int y = b->y0; y < b->y1; y++)
        for (int x = b->x0; x < b->x1; x++)
            error[y][x] = lightness((double)rgb[3 * pt_film_index(film, x, y)]) - truth[y][x];
    for (int y = b->y0; y < b->y1; y++)
        for (int x = b->x0; x < b->x1; x++) {
            double seen = 0, sum = 0, squares = 0;
            for (int i = 0; i < 25; i++) {
                const double t = at(truth, b, x + i % 5 - 2, y + i / 5 - 2);
                seen += blur[i % 5] * blur[i / 5] * at(error, b, x + i % 5 - 2, y + i / 5 - 2);
                sum += t / 25;
                squares += t * t / 25;
            }
            sixth += pow(seen, 6) / n;
            texture += sqrt(fmax(0, squares - sum * sum)) / n;
        }
    return pow(sixth, 1.0 / 6) / sqrt(texture + 2) / LEVEL;
}

/* --- rendering --------------------------------------------------------------------------------------------------------- */

static struct lull_host_criterion *open_criterion(struct base_threads *pool)
{
    struct lull_host_criterion *c = NULL;
    const struct lull_criterion *table;
    struct base_err err = {0};
    if (pt_criterion_find("denoised", NULL, NULL, &table, &err))
        fail_msg("%s", err.text);
    if (pt_criterion_create(table, NULL, 0, pool, NULL, &c, &err)) {
        print_message("skipped: %s\n", err.text);
        skip();
    }
    return c;
}

static void a_picture(void **state)
{
    const struct pt_render_config config = {.width = W,
                                            .height = H,
                                            .crop = {7, 5, 93, 83},
                                            .block_width = BLOCK,
                                            .block_height = BLOCK,
                                            .spp_min = 16,
                                            .spp_max = SPP_MAX,
                                            .planes = PT_FILM_HALF | PT_FILM_ALBEDO | PT_FILM_NORMAL,
                                            .integrator = {.max_component = INFINITY}};
    const struct pt_render_hooks hooks = {0};
    struct base_err err = {0};
    struct base_threads *pool = base_threads_create(2, &err);
    struct lull_host_criterion *criterion = open_criterion(pool);
    struct pt_render *r = NULL;
    struct pt_denoised made;
    enum pt_render_outcome outcome;
    double worst = 0;
    uint64_t spp = 0;
    subject = *state;
    know();
    if (pt_render_create(&config, NULL, kernel, pool, criterion, &r, &err) || pt_render_run(r, &hooks, &outcome, &err) ||
        pt_denoised_make(r, PT_PICTURE_BLEND, NULL, NULL, &made, &err))
        fail_msg("%s", err.text);
    assert_int_equal(r->totals->failed_checks, 0);
    for (uint32_t i = 0; i < r->blocks->count; i++) {
        const struct lull_host_block *b = r->blocks->list + i;
        const double seen = visible(b, &r->film, made.rgb);
        worst = fmax(worst, seen);
        spp = b->spp > spp ? b->spp : spp;
        if (b->reason == LULL_REASON_CRITERION && !(seen < subject->seen && b->spp >= subject->least))
            fail_msg("%s: block %u stopped after %llu samples, %.2f of what is just seen, %.2f believed", subject->name, i,
                     (unsigned long long)b->spp, seen, b->error);
    }
    for (size_t i = 0; i < 3 * r->film.pixels; i++)
        assert_true(isfinite(made.rgb[i]) && made.rgb[i] >= 0);
    printf("# figure %s: stopped at up to %llu samples, up to %.2f of what is just seen, weight %.2f\n", subject->name,
           (unsigned long long)spp, worst, made.weight_mean);
    assert_true(spp <= subject->most && worst < subject->kept);
    pt_denoised_release(&made);
    pt_render_destroy(r);
    lull_host_close(criterion);
    base_threads_destroy(pool);
}

int main(void)
{
    struct CMUnitTest tests[sizeof subjects / sizeof subjects[0]];
    for (size_t i = 0; i < sizeof tests / sizeof tests[0]; i++)
        tests[i] = (struct CMUnitTest){subjects[i].name, a_picture, NULL, NULL, (void *)&subjects[i]};
    return cmocka_run_group_tests_name("denoised", tests, NULL, NULL);
}
