/*
 * Noise for time: two ways of sampling lights against each other, in one scene: the hierarchy and portals, if it has one, against
 * selection by power without portals. One thread, interleaved.
 *
 *   build/bench/pt_noise SCENE.pbrt [WIDTHxHEIGHT] [SEEDS] [SPP] [SAMPLER]
 *
 * Every pixel is rendered with SPP samples by each of SEEDS seeds and each selection; the variance is that between seeds. Prints
 * one line of JSON, each a ratio of the plain way to the other, above 1 where the other is better: `time` of one path, `variance`
 * (median over 8 × 8 tiles, of the ratio within each), `gain` their product; `gain_mean` with the variance
 * relative to the tile's light, averaged over tiles before the ratio is taken (a few bright specks decide that one); and the largest `z`
 * of the difference of their tile means (64 of them: up to 5 by chance with few seeds). Scenes without a hierarchy or portal are only named.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "integ/integrator.h"
#include "pbrt/load.h"
#include "shade/light_build.h"

enum { TILES = 8, MODES = 2, SEEDS_MAX = 64 };

struct mode {
    struct pt_scene *scene;
    pt_kernel *kernel;
    double *sum, *sum2;                    /* [pixels] over seeds, of the luminance of a pixel's mean */
    double tile[TILES * TILES][SEEDS_MAX]; /* mean of each tile by seed */
    double time_s;
};

static int width = 96, height = 96, seeds = 12, spp = 4;
static struct mode modes[MODES];

static int tile_of(int x, int y)
{
    return y * TILES
    / height *TILES
    +x *TILES
    / width;
}

static void render(struct mode *m, const struct pt_integrator *settings, int seed)
{
    struct pt_integrator own = *settings;
    double start_s = base_clock_thread_s(), pixels_per_tile = (double)width * height / (TILES * TILES);
    own.seed = (uint32_t)(2 * seed + (m - modes)); /* no sample is shared */
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x += PT_RUN) {
            int n = width - x < PT_RUN ? width - x : PT_RUN;
            double mean[PT_RUN] = {0};
            for (int s = 0; s < spp; s++) {
                struct pt_path_result r[PT_RUN];
                m->kernel(m->scene, &own, (uint32_t)x, (uint32_t)y, n, (uint32_t)s, r);
                for (int i = 0; i < n; i++)
                    if (v3_is_finite(r[i].radiance))
                        mean[i] += (double)v3_luminance(r[i].radiance) / spp;
            }
            for (int i = 0; i < n; i++) {
                m->sum[y * width + x + i] += mean[i];
                m->sum2[y * width + x + i] += mean[i] * mean[i];
                m->tile[tile_of(x + i, y)][seed] += mean[i] / pixels_per_tile;
            }
        }
    m->time_s += base_clock_thread_s() - start_s;
}

/* Variance between seeds of the pixels of a tile, averaged. */
static double tile_variance(const struct mode *m, int tile)
{
    double sum = 0.0;
    int n = 0;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            if (tile_of(x, y) == tile) {
                double mean = m->sum[y * width + x] / seeds;
                sum += fmax(0.0, m->sum2[y * width + x] / seeds - mean * mean) * seeds / (seeds - 1);
                n++;
            }
    return n ? sum / n : 0.0;
}

static void tile_moments(const struct mode *m, int tile, double *mean, double *variance_of_mean)
{
    double sum = 0.0, sum2 = 0.0;
    for (int s = 0; s < seeds; s++) {
        sum += m->tile[tile][s];
        sum2 += m->tile[tile][s] * m->tile[tile][s];
    }
    *mean = sum / seeds;
    *variance_of_mean = fmax(0.0, sum2 / seeds - *mean * *mean) / (seeds - 1);
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print_result(const char *path)
{
    double ratios[TILES * TILES], relative[MODES] = {0.0}, worst = 0.0, time = modes[1].time_s / modes[0].time_s;
    int n = 0;
    for (int t = 0; t < TILES * TILES; t++) {
        double v[MODES], mean[MODES], error2[MODES];
        for (int k = 0; k < MODES; k++) {
            v[k] = tile_variance(&modes[k], t);
            tile_moments(&modes[k], t, &mean[k], &error2[k]);
        }
        double both = 0.5 * (mean[0] + mean[1]);
        if (!(v[0] > 0.0 && v[1] > 0.0 && both > 0.0))
            continue;
        for (int k = 0; k < MODES; k++)
            relative[k] += v[k] / (both * both);
        ratios[n++] = v[1] / v[0];
        worst = fmax(worst, fabs(mean[0] - mean[1]) / sqrt(error2[0] + error2[1]));
    }
    qsort(ratios, (size_t)n, sizeof *ratios, by_value);
    double variance = n ? ratios[n / 2] : 1.0, averaged = n ? relative[1] / relative[0] : 1.0;
    printf("{\"scene\":\"%s\",\"emitters\":%d,\"two_ways\":true,\"us_per_path\":%.3f,\"time\":%.3f,\"variance\":%.3f,"
           "\"gain\":%.3f,"
           "\"gain_mean\":%.3f,\"z\":%.2f}\n",
           path, modes[0].scene->emitter_count, 1e6 * modes[0].time_s / ((double)width * height * spp * seeds), time,
           variance, time * variance, time * averaged, worst);
}

/* 1 when there was a portal. */
static int close_portals(struct pt_scene *scene)
{
    struct base_err err = {0};
    int found = 0;
    for (int32_t i = 0; i < scene->light_count; i++) {
        found |= scene->lights[i].has_portal;
        scene->lights[i].has_portal = 0;
    }
    if (found && pt_lights_build(scene, &err) != 0)
        exit(1);
    return found;
}

int main(int argc, char **argv)
{
    struct pt_integrator settings = {0};
    int differ = 0;
    if (argc < 2 || (argc > 2 && sscanf(argv[2], "%dx%d", &width, &height) != 2)) {
        fprintf(stderr, "usage: %s SCENE.pbrt [WIDTHxHEIGHT] [SEEDS] [SPP] [independent|sobol]\n", argv[0]);
        return 2;
    }
    seeds = argc > 3 ? atoi(argv[3]) : seeds;
    seeds = seeds < 2 ? 2 : seeds > SEEDS_MAX ? SEEDS_MAX : seeds;
    spp = argc > 4 ? atoi(argv[4]) : spp;
    for (int k = 0; k < MODES; k++) {
        struct mode *m = &modes[k];
        struct pt_scene_defaults defaults;
        struct base_err err = {0};
        struct pt_load_options options = {.width = width,
                                          .height = height,
                                          .light_selection = k ? PT_LIGHT_SELECTION_POWER : PT_LIGHT_SELECTION_HIERARCHY};
        if (pt_scene_load(argv[1], &options, &m->scene, &defaults, &err) != 0) {
            fprintf(stderr, "%s\n", err.text);
            return 2;
        }
        settings = defaults.integrator;
        if (k == 1)
            differ |= close_portals(m->scene);
        differ |= m->scene->light_tree != NULL;
        m->kernel = pt_kernel_select(m->scene->effects, NULL, NULL);
        m->sum = calloc((size_t)width * (size_t)height, sizeof *m->sum);
        m->sum2 = calloc((size_t)width * (size_t)height, sizeof *m->sum2);
        if (!m->sum || !m->sum2)
            return 1;
    }
    if (argc > 5)
        settings.sampler = strcmp(argv[5], "sobol") == 0 ? PT_SAMPLER_SOBOL : PT_SAMPLER_INDEPENDENT;
    for (int s = 0; s < seeds && differ; s++)
        for (int k = 0; k < MODES; k++)
            render(&modes[k], &settings, s);
    if (differ)
        print_result(argv[1]);
    else
        printf("{\"scene\":\"%s\",\"emitters\":%d,\"two_ways\":false}\n", argv[1], modes[0].scene->emitter_count);
    for (int k = 0; k < MODES; k++) {
        free(modes[k].sum);
        free(modes[k].sum2);
        pt_scene_destroy(modes[k].scene);
    }
    return 0;
}
