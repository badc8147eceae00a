#include "render/rows.h"

#include <string.h>

#include "base/clock.h"
#include "render/cells.h"

/* Neighbouring pixels that get the same samples. */
struct run {
    int x, count;
    uint32_t from, to;
};

/* Samples of a run, in the order of samples in each pixel. */
static void sample_run(const struct pt_row_maker *maker, struct pt_film *film, struct pt_row *row, const struct run *run)
{
    struct pt_film_pixel pixels[PT_RUN];
    struct pt_path_result paths[PT_RUN];
    const size_t index = pt_film_index(film, run->x, row->y);
    const uint32_t planes = film->planes;
    for (int i = 0; i < run->count; i++)
        pt_film_load(film, index + (size_t)i, &pixels[i]);
    for (uint32_t s = run->from; s < run->to; s++) {
        const int in_half = pt_film_in_half(s);
        maker->kernel(maker->scene, maker->integrator, (uint32_t)run->x, (uint32_t)row->y, run->count, s, paths);
        for (int i = 0; i < run->count; i++) {
            row->rays += paths[i].rays;
            if (!pt_film_add(&pixels[i], planes, in_half, &paths[i]) && row->dropped++ == 0) {
                row->first_x = (uint32_t)(run->x + i);
                row->first_sample = s;
            }
        }
    }
    row->samples += (uint64_t)run->count * (run->to - run->from);
    for (int i = 0; i < run->count; i++) {
        pt_film_store(film, index + (size_t)i, &pixels[i]);
        if (film->spp)
            film->spp[index + (size_t)i] = run->to;
    }
}

/* The run that begins at x. */
static struct run run_at(const struct pt_film *film, const struct pt_row *row, int x)
{
    const size_t i = pt_film_index(film, x, row->y);
    const int most = row->x1 - x < PT_RUN ? row->x1 - x : PT_RUN;
    if (!film->spp)
        return (struct run){x, most, row->from, row->to};
    int n = 1;
    while (n < most && film->spp[i + (size_t)n] == film->spp[i] && film->goal[i + (size_t)n] == film->goal[i])
        n++;
    return (struct run){x, n, film->spp[i], pt_cells_reach(film->spp[i], film->goal[i], row->to, row->check)};
}

void pt_row_sample(const struct pt_row_maker *maker, struct pt_film *film, struct pt_row *row)
{
    double start_s = base_clock_thread_s();
    struct run run;
    for (int x = row->x0; x < row->x1; x += run.count) {
        run = run_at(film, row, x);
        sample_run(maker, film, row, &run);
    }
    row->thread_s = base_clock_thread_s() - start_s;
}

size_t pt_row_bytes(const struct pt_row *row, uint32_t planes)
{
    return (size_t)(row->x1 - row->x0) * pt_film_pixel_bytes(planes);
}

/* The row's part of one of the film's arrays. */
static struct pt_film_array part(const struct pt_film *film, const struct pt_row *row, struct pt_film_array whole)
{
    size_t pixel = whole.bytes / film->pixels, first = pt_film_index(film, row->x0, row->y);
    return (struct pt_film_array){(unsigned char *)whole.data + first * pixel, (size_t)(row->x1 - row->x0) * pixel};
}

void pt_row_save(const struct pt_film *film, const struct pt_row *row, unsigned char *bytes)
{
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, arrays);
    for (int i = 0; i < n; i++) {
        struct pt_film_array p = part(film, row, arrays[i]);
        memcpy(bytes, p.data, p.bytes);
        bytes += p.bytes;
    }
}

void pt_row_restore(struct pt_film *film, const struct pt_row *row, const unsigned char *bytes)
{
    struct pt_film_array arrays[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(film, arrays);
    for (int i = 0; i < n; i++) {
        struct pt_film_array p = part(film, row, arrays[i]);
        memcpy(p.data, bytes, p.bytes);
        bytes += p.bytes;
    }
}
