#include "render/rows.h"

#include <string.h>

#include "base/clock.h"

/* Samples of `count` neighbours from x on, in the order of samples in each pixel. */
static void sample_run(const struct pt_sampler_context *context, struct pt_film *film, struct pt_row *row, int x, int count)
{
    struct pt_film_pixel pixels[PT_RUN];
    struct pt_path_result paths[PT_RUN];
    const size_t index = pt_film_index(film, x, row->y);
    const uint32_t planes = film->planes;
    for (int i = 0; i < count; i++)
        pt_film_load(film, index + (size_t)i, &pixels[i]);
    for (uint32_t s = row->from; s < row->to; s++) {
        const int in_half = pt_film_in_half(s);
        context->kernel(context->scene, context->integrator, (uint32_t)x, (uint32_t)row->y, count, s, paths);
        for (int i = 0; i < count; i++) {
            row->rays += paths[i].rays;
            if (!pt_film_add(&pixels[i], planes, in_half, &paths[i]) && row->dropped++ == 0) {
                row->first_x = (uint32_t)(x + i);
                row->first_sample = s;
            }
        }
    }
    row->samples += (uint64_t)count * (row->to - row->from);
    for (int i = 0; i < count; i++)
        pt_film_store(film, index + (size_t)i, &pixels[i]);
}

void pt_row_sample(const struct pt_sampler_context *context, struct pt_film *film, struct pt_row *row)
{
    double start_s = base_clock_thread_s();
    for (int x = row->x0; x < row->x1; x += PT_RUN)
        sample_run(context, film, row, x, row->x1 - x < PT_RUN ? row->x1 - x : PT_RUN);
    row->thread_s = base_clock_thread_s() - start_s;
}

size_t pt_row_bytes(const struct pt_row *row, uint32_t planes)
{
    return (size_t)(row->x1 - row->x0) * pt_film_pixel_bytes(planes);
}

void pt_row_save(const struct pt_film *film, const struct pt_row *row, unsigned char *bytes)
{
    struct pt_film_array parts[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, pt_film_index(film, row->x0, row->y), (size_t)(row->x1 - row->x0), parts);
    for (int i = 0; i < n; bytes += parts[i++].bytes)
        memcpy(bytes, parts[i].data, parts[i].bytes);
}

void pt_row_restore(struct pt_film *film, const struct pt_row *row, const unsigned char *bytes)
{
    struct pt_film_array parts[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, pt_film_index(film, row->x0, row->y), (size_t)(row->x1 - row->x0), parts);
    for (int i = 0; i < n; bytes += parts[i++].bytes)
        memcpy(parts[i].data, bytes, parts[i].bytes);
}
