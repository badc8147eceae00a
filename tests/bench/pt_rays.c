/*
 * How much of the time of a render is spent tracing rays: the kernel against a loop that only traces the rays that the kernel
 * traced, one by one in the same order, without shading; and against one that traces together what the kernel traced together. One thread,
 * interleaved, medians.
 *
 *   build/bench/pt_rays SCENE.pbrt|cornell [WIDTHxHEIGHT] [ROUNDS] [MAX_DEPTH] [all]
 *
 * Prints one line of JSON: paths/s, rays/s, rays/s of the ray-only loop, the share of the two, rays/s of those together.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "geom/accel.h"
#include "integ/integrator.h"
#include "pbrt/load.h"
#include "support/pt_scenes.h"

enum { RAYS_MAX = 4000000, ROUNDS_MAX = 64 };

/* A ray that the kernel traced. Those that were asked for together follow one another. */
static struct recorded_ray {
    struct pt_ray ray;
    int occlusion, coherent;
    int group; /* rays from this one on that went together; 0: not the first of them */
} * recorded;
static size_t ray_count;

static void record(const struct pt_ray *ray, int occlusion, int coherent, int group)
{
    if (ray_count < RAYS_MAX)
        recorded[ray_count++] = (struct recorded_ray){*ray, occlusion, coherent, group};
}

static int intersect_recorded(const struct pt_scene *scene, const struct pt_ray *ray, struct pt_hit *hit)
{
    record(ray, 0, 0, 1);
    return pt_accel_intersect(scene, ray, hit);
}

static void intersect_many_recorded(const struct pt_scene *scene, const struct pt_ray *const *r, int count, int coherent,
                                    struct pt_hit *const *hits)
{
    for (int i = 0; i < count; i++)
        record(r[i], 0, coherent, i == 0 ? count : 0);
    pt_accel_intersect_many(scene, r, count, coherent, hits);
}

static void occluded_many_recorded(const struct pt_scene *scene, const struct pt_ray *const *r, int count, uint8_t *occluded)
{
    for (int i = 0; i < count; i++)
        record(r[i], 1, 0, i == 0 ? count : 0);
    pt_accel_occluded_many(scene, r, count, occluded);
}

/* The kernel once more, with its queries going through the recorder. */
#define pt_accel_intersect intersect_recorded
#define pt_accel_intersect_many intersect_many_recorded
#define pt_accel_occluded_many occluded_many_recorded
#include "integ/run.h"
#undef pt_accel_intersect
#undef pt_accel_intersect_many
#undef pt_accel_occluded_many

struct window {
    uint32_t width, height, row_step;
};

static unsigned long long run_kernel(const struct pt_scene *scene, const struct pt_integrator *settings, pt_kernel *kernel,
                                     const struct window *w, uint32_t sample, unsigned long long *paths)
{
    unsigned long long count = 0;
    struct pt_path_result result[PT_RUN];
    for (uint32_t y = 0; y < w->height; y += w->row_step)
        for (uint32_t x = 0; x < w->width; x += PT_RUN) {
            int n = w->width - x < PT_RUN ? (int)(w->width - x) : PT_RUN;
            kernel(scene, settings, x, y, n, sample, result);
            for (int i = 0; i < n; i++)
                count += result[i].rays;
            *paths += (unsigned)n;
        }
    return count;
}

static void record_rays(const struct pt_scene *scene, const struct pt_integrator *settings, const struct window *w)
{
    const pt_effects through = PT_FX_INTERFACE | PT_FX_ALPHA; /* they turn occlusion queries into nearest hits */
    struct pt_path_result result[PT_RUN];
    for (uint32_t y = 0; y < w->height; y += w->row_step)
        for (uint32_t x = 0; x < w->width; x += PT_RUN) {
            int n = w->width - x < PT_RUN ? (int)(w->width - x) : PT_RUN;
            if (scene->effects & through)
                pt_run_sample(PT_FX_ALL, scene, settings, x, y, n, 0, NULL, result);
            else
                pt_run_sample(PT_FX_ALL & ~through, scene, settings, x, y, n, 0, NULL, result);
        }
    while (ray_count > 0 && ray_count == RAYS_MAX && recorded[ray_count - 1].group == 0)
        ray_count--; /* the list ended within a group */
    if (ray_count == RAYS_MAX)
        ray_count--;
}

/* One ray at a time. */
static int occluded_one(const struct pt_scene *scene, const struct pt_ray *ray)
{
    uint8_t occluded;
    pt_accel_occluded_many(scene, &ray, 1, &occluded);
    return occluded;
}

static unsigned long long replay_single(const struct pt_scene *scene)
{
    unsigned long long hits = 0;
    for (size_t i = 0; i < ray_count; i++) {
        struct pt_hit hit;
        hits += (unsigned)(recorded[i].occlusion ? occluded_one(scene, &recorded[i].ray)
                                                 : pt_accel_intersect(scene, &recorded[i].ray, &hit));
    }
    return hits;
}

static unsigned long long replay_groups(const struct pt_scene *scene)
{
    unsigned long long count = 0;
    for (size_t i = 0; i < ray_count; i += (size_t)recorded[i].group) {
        struct pt_hit hit[PT_RUN], *hits[PT_RUN];
        const struct pt_ray *r[PT_RUN];
        uint8_t occluded[PT_RUN];
        int n = recorded[i].group;
        for (int k = 0; k < n; k++) {
            r[k] = &recorded[i + (size_t)k].ray;
            hits[k] = &hit[k];
        }
        if (recorded[i].occlusion)
            pt_accel_occluded_many(scene, r, n, occluded);
        else
            pt_accel_intersect_many(scene, r, n, recorded[i].coherent, hits);
        for (int k = 0; k < n; k++)
            count += recorded[i].occlusion ? occluded[k] : (unsigned)(hit[k].shape >= 0);
    }
    return count;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int n)
{
    qsort(values, (size_t)n, sizeof *values, by_value);
    return n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

static void measure(const struct pt_scene *scene, const struct pt_integrator *settings, const char *name, pt_kernel *kernel,
                    const struct window *w, int rounds)
{
    double paths_s[ROUNDS_MAX], rays_s[ROUNDS_MAX], only_s[ROUNDS_MAX], share[ROUNDS_MAX], together_s[ROUNDS_MAX];
    unsigned long long sink = 0;
    for (int i = 0; i < rounds; i++) {
        unsigned long long paths = 0;
        double t0 = base_clock_thread_s();
        unsigned long long traced = run_kernel(scene, settings, kernel, w, (uint32_t)i, &paths);
        double t1 = base_clock_thread_s();
        sink += replay_single(scene);
        double t2 = base_clock_thread_s();
        sink += replay_groups(scene);
        double t3 = base_clock_thread_s();
        paths_s[i] = (double)paths / (t1 - t0);
        rays_s[i] = (double)traced / (t1 - t0);
        only_s[i] = (double)ray_count / (t2 - t1);
        together_s[i] = (double)ray_count / (t3 - t2);
        share[i] = rays_s[i] / only_s[i];
    }
    printf("{\"kernel\":\"%s\",\"paths_per_s\":%.0f,\"rays_per_s\":%.0f,\"ray_only_per_s\":%.0f,\"share\":%.3f,\"together_"
           "per_s\":%.0f,\"hits\":%llu}\n",
           name, median(paths_s, rounds), median(rays_s, rounds), median(only_s, rounds), median(share, rounds),
           median(together_s, rounds), sink);
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        fprintf(stderr, "usage: %s SCENE.pbrt|cornell [WIDTHxHEIGHT] [ROUNDS] [MAX_DEPTH] [all]\n", argv[0]);
        return 2;
    }
    struct pt_scene cornell, *scene = &cornell;
    struct pt_integrator settings = test_integrator(8);
    struct window w = {400, 400, 1};
    int rounds = argc > 3 ? atoi(argv[3]) : 7, builtin = strcmp(argv[1], "cornell") == 0;
    rounds = rounds < 1 ? 1 : rounds > ROUNDS_MAX ? ROUNDS_MAX : rounds;
    if (argc > 2 && sscanf(argv[2], "%ux%u", &w.width, &w.height) != 2)
        return 2;
    if (builtin) {
        test_cornell(&cornell, (int)w.width, 1.0f, v3_splat(0.0f));
    } else {
        struct pt_scene_defaults defaults;
        struct base_err err = {0};
        struct pt_load_options options = {.width = (int)w.width, .height = (int)w.height};
        if (pt_scene_load(argv[1], &options, &scene, &defaults, &err) != 0) {
            fprintf(stderr, "%s\n", err.text);
            return 2;
        }
        settings = defaults.integrator;
    }
    if (argc > 4 && atoi(argv[4]) != 0)
        settings.max_depth = atoi(argv[4]);
    recorded = malloc(RAYS_MAX * sizeof *recorded);
    if (!recorded)
        return 1;
    /* about 100,000 paths a round: whole rows, spread over the height */
    while ((unsigned long long)w.width * (w.height / w.row_step) > 100000)
        w.row_step++;
    record_rays(scene, &settings, &w);
    const char *name;
    pt_kernel *kernel = pt_kernel_select(argc > 5 ? PT_FX_ALL : scene->effects, NULL, &name);
    measure(scene, &settings, name, kernel, &w, rounds);
    free(recorded);
    if (builtin)
        test_scene_end(scene);
    else
        pt_scene_destroy(scene);
    return 0;
}
