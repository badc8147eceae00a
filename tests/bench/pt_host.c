/*
 * What the film costs on top of the kernel: single-threaded rows of a scene, rendered by the kernel alone and through the
 * film with the planes of halfbuf and with all planes, interleaved in one run, as ratios of medians. The criterion's share is
 * measured by a render itself (totals.criterion_s of the report).
 *
 *   build/bench/pt_host SCENE.pbrt [ROUNDS] [SPP_PER_SLICE]
 *
 * Prints one line of JSON.
 */
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "render/film.h"
#include "pbrt/load.h"

enum { ROUNDS_MAX = 101, ROWS = 8 };

struct bench {
    struct pt_scene *scene;
    struct pt_integrator integrator;
    pt_kernel *kernel;
    int width, y0;
    uint32_t spp;
    double sink;
};

static double run_kernel(struct bench *b, uint32_t first)
{
    double start_s = base_clock_thread_s();
    for (int y = b->y0; y < b->y0 + ROWS; y++)
        for (int x = 0; x < b->width; x++)
            for (uint32_t s = first; s < first + b->spp; s++) {
                struct pt_path_result r;
                b->kernel(b->scene, &b->integrator, (uint32_t)x, (uint32_t)y, 1, s, &r);
                b->sink += (double)r.radiance.x;
            }
    return base_clock_thread_s() - start_s;
}

static double run_film(struct bench *b, struct pt_film *film, uint32_t first)
{
    double start_s = base_clock_thread_s();
    for (int y = b->y0; y < b->y0 + ROWS; y++)
        for (int x = 0; x < b->width; x++) {
            struct pt_film_pixel p;
            size_t i = pt_film_index(film, x, y);
            pt_film_load(film, i, &p);
            for (uint32_t s = first; s < first + b->spp; s++) {
                struct pt_path_result r;
                b->kernel(b->scene, &b->integrator, (uint32_t)x, (uint32_t)y, 1, s, &r);
                pt_film_add(&p, film->planes, pt_film_in_half(s), &r);
            }
            pt_film_store(film, i, &p);
        }
    return base_clock_thread_s() - start_s;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *v, int n)
{
    qsort(v, (size_t)n, sizeof *v, ascending);
    return v[n / 2];
}

int main(int argc, char **argv)
{
    struct base_err err = {0};
    struct pt_load_options options = {.quiet = 1};
    struct pt_scene_defaults d;
    struct bench b = {0};
    struct pt_film half, all;
    static double ratio_half[ROUNDS_MAX], ratio_all[ROUNDS_MAX];
    int rounds = argc > 2 ? atoi(argv[2]) : 15;
    b.spp = argc > 3 ? (uint32_t)atoi(argv[3]) : 8;
    if (argc < 2 || rounds < 1 || rounds > ROUNDS_MAX || pt_scene_load(argv[1], &options, &b.scene, &d, &err) != 0) {
        fprintf(stderr, "pt_host: %s\n", argc < 2 ? "usage: pt_host SCENE.pbrt [ROUNDS] [SPP]" : err.text);
        return 2;
    }
    b.integrator = d.integrator;
    b.kernel = pt_kernel_select(b.scene->effects, NULL, NULL);
    b.width = d.width;
    b.y0 = d.height / 2;
    if (pt_film_init(&half, 0, 0, d.width, d.height, PT_FILM_HALF, &err) != 0 ||
        pt_film_init(&all, 0, 0, d.width, d.height, PT_FILM_ALL, &err) != 0)
        return 1;
    for (int k = -1; k < rounds; k++) { /* the first round warms up */
        uint32_t first = (uint32_t)(k + 1) * b.spp;
        b.integrator.want_aux = 0;
        double kernel_s = run_kernel(&b, first), half_s = run_film(&b, &half, first);
        b.integrator.want_aux = 1;
        double all_s = run_film(&b, &all, first);
        if (k >= 0) {
            ratio_half[k] = half_s / kernel_s;
            ratio_all[k] = all_s / kernel_s;
        }
    }
    printf("{\"film_halfbuf_share\": %.4f, \"film_all_share\": %.4f, \"film_bytes_per_pixel_all\": %zu}\n",
           median(ratio_half, rounds) - 1.0, median(ratio_all, rounds) - 1.0, pt_film_pixel_bytes(PT_FILM_ALL));
    pt_film_release(&half);
    pt_film_release(&all);
    pt_scene_destroy(b.scene);
    return b.sink == -1.0;
}
