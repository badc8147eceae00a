/*
 * What Sobol' points are worth: their mean squared error against that of independent numbers, in one scene. One thread.
 *
 *   build/bench/pt_sampler SCENE.pbrt [WIDTHxHEIGHT] [SEEDS] [REFERENCE_SPP]
 *   build/bench/pt_sampler SCENE.pbrt WIDTHxHEIGHT 0 SPP independent|sobol     (draws SPP samples and says nothing: to count instructions)
 *
 * The reference is drawn with independent numbers. Its own samples say how far it is off, which is taken away from the squared
 * differences, and what the error of N independent samples is. Pixels count relative to their light. Prints one line of JSON: the
 * ratio of Sobol's error to that of as many independent samples, at each number of samples, and the standard error of each ratio by
 * the scatter of the seeds.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "integ/integrator.h"
#include "pbrt/load.h"

enum { REFERENCE_SEED = 1000 };

static const int spps[] = {64, 256, 1024};
enum { LEVELS = sizeof spps / sizeof *spps };

static int width = 32, height = 32, seeds = 8, reference_spp = 8192;
static struct pt_scene *scene;
static struct pt_integrator settings;
static double *sum, *sum2, *reference, *variance, *weight; /* [pixels]; variance: of one independent sample */

/* Adds samples [first, end) of all pixels to the sums of luminance and of its square. */
static void draw(int first, int end)
{
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x += PT_RUN) {
            int n = width - x < PT_RUN ? width - x : PT_RUN;
            for (int s = first; s < end; s++) {
                struct pt_path_result r[PT_RUN];
                kernel(scene, &settings, (uint32_t)x, (uint32_t)y, n, (uint32_t)s, r);
                for (int i = 0; i < n; i++) {
                    double value = v3_is_finite(r[i].radiance) ? (double)v3_luminance(r[i].radiance) : 0.0;
                    sum[y * width + x + i] += value;
                    sum2[y * width + x + i] += value * value;
                }
            }
        }
}

static void begin(int sampler, int seed)
{
    settings.sampler = sampler;
    settings.seed = (uint32_t)seed;
    memset(sum, 0, (size_t)(width * height) * sizeof *sum);
    memset(sum2, 0, (size_t)(width * height) * sizeof *sum2);
}

static void draw_reference(void)
{
    double n = reference_spp, mean = 0.0;
    begin(PT_SAMPLER_INDEPENDENT, REFERENCE_SEED);
    draw(0, reference_spp);
    for (int i = 0; i < width * height; i++) {
        reference[i] = sum[i] / n;
        variance[i] = fmax(0.0, sum2[i] / n - reference[i] * reference[i]) * n / (n - 1.0);
        mean += reference[i] / (width * height);
    }
    for (int i = 0; i < width * height; i++)
        weight[i] =
            1.0 / (reference[i] * reference[i] + 0.01 * mean * mean); /* the floor keeps black pixels from deciding */
}

/* Squared difference between the sums of `spp` samples and the reference, without the reference's own share, over the error of
 * `spp` independent samples. */
static double relative_error(int spp)
{
    double error = 0.0, independent = 0.0;
    for (int i = 0; i < width * height; i++) {
        double d = sum[i] / spp - reference[i];
        error += weight[i] * (d * d - variance[i] / reference_spp);
        independent += weight[i] * variance[i] / spp;
    }
    return independent > 0.0 ? error / independent : 1.0;
}

static void compare(const char *path)
{
    double mean[LEVELS] = {0.0}, square[LEVELS] = {0.0};
    draw_reference();
    for (int s = 0; s < seeds; s++) {
        begin(PT_SAMPLER_SOBOL, s);
        for (int k = 0; k < LEVELS; k++) {
            draw(k ? spps[k - 1] : 0, spps[k]);
            double ratio = relative_error(spps[k]);
            mean[k] += ratio / seeds;
            square[k] += ratio * ratio / seeds;
        }
    }
    printf("{\"scene\":\"%s\"", path);
    for (int k = 0; k < LEVELS; k++)
        printf(",\"%d\":[%.4f,%.4f]", spps[k], mean[k], sqrt(fmax(0.0, square[k] - mean[k] * mean[k]) / (seeds - 1)));
    printf("}\n");
}

int main(int argc, char **argv)
{
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    if (argc < 2 || (argc > 2 && (sscanf(argv[2], "%dx%d", &width, &height) != 2 || width < 1 || height < 1))) {
        fprintf(stderr, "usage: %s SCENE.pbrt [WIDTHxHEIGHT] [SEEDS] [REFERENCE_SPP] [independent|sobol]\n", argv[0]);
        return 2;
    }
    seeds = argc > 3 ? atoi(argv[3]) : seeds;
    seeds = seeds < 2 ? 2 : seeds;
    reference_spp = argc > 4 ? atoi(argv[4]) : reference_spp;
    struct pt_load_options options = {.width = width, .height = height};
    if (pt_scene_load(argv[1], &options, &scene, &defaults, &err) != 0) {
        fprintf(stderr, "%s\n", err.text);
        return 2;
    }
    settings = defaults.integrator;
    const size_t pixels = (size_t)width * (size_t)height;
    sum = calloc(5 * pixels, sizeof *sum);
    if (!sum)
        return 1;
    sum2 = sum + pixels, reference = sum2 + pixels, variance = reference + pixels, weight = variance + pixels;
    if (argc > 5) {
        begin(strcmp(argv[5], "sobol") == 0 ? PT_SAMPLER_SOBOL : PT_SAMPLER_INDEPENDENT, 0);
        draw(0, reference_spp);
    } else
        compare(argv[1]);
    free(sum);
    pt_scene_destroy(scene);
    return 0;
}
