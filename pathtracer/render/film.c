#include "render/film.h"

#include <stdlib.h>

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

static int wanted(uint32_t planes, int i) { return arrays[i].plane == 0 || (planes & arrays[i].plane) != 0; }

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

int pt_film_list_arrays(const struct pt_film *film, size_t first, size_t pixels, struct pt_film_array out[PT_FILM_ARRAYS])
{
    int n = 0;
    for (int i = 0; i < ARRAYS; i++)
        if (wanted(film->planes, i))
            out[n++] = (struct pt_film_array){(unsigned char *)get_array(film, i) + first * arrays[i].bytes,
                                              pixels * arrays[i].bytes};
    return n;
}

/* Both means are to the last bit what a criterion makes of the sums (lull_kit_read, which multiplies with 1/N, of what the
 * host library shows it): a recording has the codes of one mean, a network those of the other. */
void pt_film_mean(const struct pt_film *f, size_t i, uint64_t spp, double rgb[3])
{
    const double factor = spp > f->dropped[i] ? 1.0 / (double)(spp - f->dropped[i]) : 0.0;
    for (size_t c = 0; c < 3; c++)
        rgb[c] = f->color[3 * i + c] * factor;
}

void pt_film_half_mean(const struct pt_film *f, size_t i, uint64_t half_spp, double rgb[3])
{
    const uint32_t dropped = f->dropped_half[i];
    const double factor = half_spp > dropped ? 1.0 / (double)half_spp : 0.0;
    const double up = half_spp > dropped ? (double)half_spp / (double)(half_spp - dropped) : 1.0;
    for (size_t c = 0; c < 3; c++)
        rgb[c] = f->half[3 * i + c] * up * factor;
}
