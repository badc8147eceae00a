#include "render/film.h"

#include <stdlib.h>
#include <string.h>

/* One row per array: the plane that asks for it (0: always), its place in the struct, bytes per pixel. */
static const struct array {
    uint32_t plane;
    size_t offset, bytes;
} arrays[] = {
    {0, offsetof(struct pt_film, color), 3 * sizeof(double)},
    {PT_FILM_HALF, offsetof(struct pt_film, half), 3 * sizeof(double)},
    {PT_FILM_MOMENT2, offsetof(struct pt_film, moment2), sizeof(double)},
    {PT_FILM_ALBEDO, offsetof(struct pt_film, albedo), 3 * sizeof(double)},
    {PT_FILM_NORMAL, offsetof(struct pt_film, normal), 3 * sizeof(double)},
    {PT_FILM_DEPTH, offsetof(struct pt_film, depth), sizeof(double)},
    {PT_FILM_DEPTH, offsetof(struct pt_film, depth_hits), sizeof(uint32_t)},
    {0, offsetof(struct pt_film, dropped), sizeof(uint32_t)},
    {PT_FILM_HALF, offsetof(struct pt_film, dropped_half), sizeof(uint32_t)},
};
enum { ARRAYS = sizeof arrays / sizeof arrays[0] };
_Static_assert((int)ARRAYS == (int)PT_FILM_ARRAYS, "pt_film_list_arrays has room for all");

static void *get_array(const struct pt_film *film, int i)
{
    void *p;
    memcpy(&p, (const char *)film + arrays[i].offset, sizeof p);
    return p;
}

static int wanted(uint32_t planes, int i)
{
    return arrays[i].plane == 0 || (planes & arrays[i].plane) != 0;
}

size_t pt_film_pixel_bytes(uint32_t planes)
{
    size_t bytes = 0;
    for (int i = 0; i < ARRAYS; i++)
        bytes += wanted(planes, i) ? arrays[i].bytes : 0;
    return bytes;
}

int pt_film_init(struct pt_film *film, int x0, int y0, int x1, int y1, uint32_t planes, struct base_err *err)
{
    struct pt_film f = {.x0 = x0, .y0 = y0, .x1 = x1, .y1 = y1, .planes = planes | PT_FILM_COLOR};
    f.pixels = (size_t)(x1 - x0) * (size_t)(y1 - y0);
    for (int i = 0; i < ARRAYS; i++) {
        if (!wanted(planes, i))
            continue;
        void *p = calloc(f.pixels, arrays[i].bytes);
        if (!p) {
            pt_film_release(&f);
            return base_fail_nomem(err, "film");
        }
        memcpy((char *)&f + arrays[i].offset, &p, sizeof p);
        f.bytes += f.pixels * arrays[i].bytes;
    }
    *film = f;
    return 0;
}

void pt_film_release(struct pt_film *film)
{
    for (int i = 0; i < ARRAYS; i++)
        free(get_array(film, i));
    *film = (struct pt_film){0};
}

int pt_film_list_arrays(const struct pt_film *film, struct pt_film_array out[PT_FILM_ARRAYS])
{
    int n = 0;
    for (int i = 0; i < ARRAYS; i++)
        if (wanted(film->planes, i))
            out[n++] = (struct pt_film_array){get_array(film, i), film->pixels * arrays[i].bytes};
    return n;
}

/* A sum as if all samples had been kept: sum / spp is the mean (pt_film_patch). */
static double filled(double sum, uint64_t spp, uint32_t dropped)
{
    return spp > dropped ? sum * ((double)spp / (double)(spp - dropped)) : sum;
}

/* To the last bit what a criterion makes of the filled sums (lull_kit_read, which multiplies with 1/N): a recording has the
 * codes of one mean, a network those of the other. */
static void mean_of(const double *sum, uint64_t spp, uint32_t dropped, double rgb[3])
{
    const double factor = spp > dropped ? 1.0 / (double)spp : 0.0;
    for (int c = 0; c < 3; c++)
        rgb[c] = filled(sum[c], spp, dropped) * factor;
}

void pt_film_mean(const struct pt_film *f, size_t i, uint64_t spp, double rgb[3])
{
    mean_of(f->color + 3 * i, spp, f->dropped[i], rgb);
}

void pt_film_half_mean(const struct pt_film *f, size_t i, uint64_t half_spp, double rgb[3])
{
    mean_of(f->half + 3 * i, half_spp, f->dropped_half[i], rgb);
}

struct pt_film_patch_pixel {
    size_t index;
    double color[3], half[3], moment2;
};

static void scale(double *sum, int n, uint64_t spp, uint32_t dropped)
{
    for (int c = 0; c < n; c++)
        sum[c] = filled(sum[c], spp, dropped);
}

int pt_film_patch(struct pt_film *f, int x0, int y0, int x1, int y1, uint64_t spp, struct pt_film_patch *patch,
                  struct base_err *err)
{
    uint64_t half_spp = pt_film_half_spp(spp);
    for (int y = y0; y < y1; y++) {
        for (int x = x0; x < x1; x++) {
            size_t i = pt_film_index(f, x, y);
            if (f->dropped[i] == 0)
                continue;
            if (patch->count == patch->room) {
                size_t room = patch->room ? 2 * patch->room : 64;
                struct pt_film_patch_pixel *grown = realloc(patch->pixels, room * sizeof *grown);
                if (!grown)
                    return base_fail_nomem(err, "pixels with dropped samples");
                patch->pixels = grown;
                patch->room = room;
            }
            struct pt_film_patch_pixel *p = &patch->pixels[patch->count++];
            *p = (struct pt_film_patch_pixel){.index = i};
            memcpy(p->color, f->color + 3 * i, sizeof p->color);
            scale(f->color + 3 * i, 3, spp, f->dropped[i]);
            if (f->half) {
                memcpy(p->half, f->half + 3 * i, sizeof p->half);
                scale(f->half + 3 * i, 3, half_spp, f->dropped_half[i]);
            }
            if (f->moment2) {
                p->moment2 = f->moment2[i];
                scale(f->moment2 + i, 1, spp, f->dropped[i]);
            }
        }
    }
    return 0;
}

void pt_film_unpatch(struct pt_film *f, struct pt_film_patch *patch)
{
    for (size_t k = 0; k < patch->count; k++) {
        const struct pt_film_patch_pixel *p = &patch->pixels[k];
        memcpy(f->color + 3 * p->index, p->color, sizeof p->color);
        if (f->half)
            memcpy(f->half + 3 * p->index, p->half, sizeof p->half);
        if (f->moment2)
            f->moment2[p->index] = p->moment2;
    }
    free(patch->pixels);
    *patch = (struct pt_film_patch){0};
}
