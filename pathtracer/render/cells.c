#include "render/cells.h"

#include <math.h>

#include "base/colour.h"

static const double LEAST = 0.5, MOST = 4.0; /* samples of a cell over the mean of its block */

/* The rows of one parity in one cell: their pixels have always had equally many samples. */
struct strip {
    double noise;  /* mean square of N, the noise of the mean as it is shown, L* */
    double weight; /* of its samples, a power of two */
    uint32_t pixels, spp, goal;
};

struct grid {
    const struct pt_cells_wave *wave;
    struct strip *strips; /* [rows][columns][2]; the other parity of strip k is k ^ 1 */
    int columns;
    size_t count;
};

static int cells_along(int side, int cell) { return (side - 1) / cell + 1; }

size_t pt_cells_scratch(int width, int height, int cell)
{
    return (size_t)cells_along(width, cell) * (size_t)cells_along(height, cell) * 2 * sizeof(struct strip);
}

static struct strip *strip_at(const struct grid *g, int x, int y)
{
    const struct pt_cells_wave *w = g->wave;
    const size_t cell = (size_t)((y - w->y0) / w->cell * g->columns + (x - w->x0) / w->cell);
    return &g->strips[2 * cell + (size_t)(y & 1)];
}

static double clamp01(double v) { return v > 0.0 ? fmin(v, 1.0) : 0.0; }

/* CIE L* of a sum of radiance on a display whose white is 1. */
static double lightness(const double *sum, double n)
{
    const double y = base_luminance(clamp01(sum[0] / n), clamp01(sum[1] / n), clamp01(sum[2] / n));
    return y > 216.0 / 24389.0 ? 116.0 * cbrt(y) - 16.0 : 24389.0 / 27.0 * y;
}

/* Half of what the two halves of a pixel's samples differ by; a half without a sample says nothing. */
static double noise_of(const struct pt_film *f, size_t i)
{
    const double each = 0.5 * (double)f->spp[i], a = each - f->dropped_half[i],
                 b = each - (double)(f->dropped[i] - f->dropped_half[i]);
    double rest[3];
    for (size_t c = 0; c < 3; c++)
        rest[c] = f->color[3 * i + c] - f->half[3 * i + c];
    return a > 0.0 && b > 0.0 ? 0.5 * (lightness(f->half + 3 * i, a) - lightness(rest, b)) : 0.0;
}

static int under_way(const struct pt_film *f, const struct pt_cells_wave *w)
{
    for (int y = w->y0; y < w->y1; y++)
        for (int x = w->x0; x < w->x1; x++)
            if (f->spp[pt_film_index(f, x, y)] < f->goal[pt_film_index(f, x, y)])
                return 1;
    return 0;
}

static void measure(const struct grid *g, const struct pt_film *f)
{
    const struct pt_cells_wave *w = g->wave;
    for (size_t k = 0; k < g->count; k++)
        g->strips[k] = (struct strip){.weight = 1.0};
    for (int y = w->y0; y < w->y1; y++)
        for (int x = w->x0; x < w->x1; x++) {
            const size_t i = pt_film_index(f, x, y);
            struct strip *s = strip_at(g, x, y);
            const double noise = noise_of(f, i);
            s->noise += (noise * noise - s->noise) / ++s->pixels;
            s->spp = f->spp[i];
        }
}

/* The power of two nearest to x > 0, by its logarithm, in [LEAST, MOST]. */
static double nearest_power(double x)
{
    int exponent;
    const double mantissa = frexp(x, &exponent); /* in [1/2, 1) */
    return fmin(fmax(ldexp(1.0, exponent - (mantissa * mantissa < 0.5)), LEAST), MOST);
}

/* s^(3/4) of a strip, as the other rows of its cell tell; a cell of one row says nothing: -1. */
static double wanted(const struct grid *g, size_t k)
{
    const struct strip *other = &g->strips[k ^ 1];
    const double seen = sqrt(other->noise * other->spp);
    return other->pixels > 0 ? sqrt(seen) * sqrt(sqrt(seen)) : -1.0;
}

static void weigh(const struct grid *g)
{
    double sum = 0.0, pixels = 0.0;
    for (size_t k = 0; k < g->count; k++)
        if (wanted(g, k) >= 0.0) {
            sum += g->strips[k].pixels * wanted(g, k);
            pixels += g->strips[k].pixels;
        }
    for (size_t k = 0; k < g->count && sum > 0.0; k++)
        if (wanted(g, k) >= 0.0)
            g->strips[k].weight = nearest_power(fmax(wanted(g, k) * pixels / sum, LEAST));
}

static uint32_t up_to_step(double spp) { return (uint32_t)ceil(spp / PT_CELLS_STEP) * PT_CELLS_STEP; }

/* Of a strip, `unit` being the samples for a weight of 1; grows with it. No sample is taken back. */
static uint32_t goal_of(const struct strip *s, uint32_t to, double unit)
{
    const uint32_t asked = (uint32_t)(fmin(unit * s->weight, MOST * to) / PT_CELLS_STEP) * PT_CELLS_STEP;
    const uint32_t least = up_to_step(LEAST * to), goal = asked > least ? asked : least;
    return goal > s->spp ? goal : s->spp;
}

static uint64_t samples_of(const struct grid *g, double unit)
{
    uint64_t sum = 0;
    for (size_t k = 0; k < g->count; k++)
        sum += (uint64_t)g->strips[k].pixels * goal_of(&g->strips[k], g->wave->to, unit);
    return sum;
}

/* Goals of the largest unit that gives no more than the wave's samples; what is left goes to strips that a larger one would
 * give a step more, from one on that changes from wave to wave. */
static void share_out(const struct grid *g)
{
    const uint32_t to = g->wave->to;
    const uint64_t all = (uint64_t)(g->wave->x1 - g->wave->x0) * (uint64_t)(g->wave->y1 - g->wave->y0) * to;
    double unit = LEAST / MOST * to, beyond = MOST / LEAST * to;
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (unit + beyond);
        *(samples_of(g, middle) <= all ? &unit : &beyond) = middle;
    }
    uint64_t left = all - samples_of(g, unit);
    const size_t first = (uint32_t)(to / PT_CELLS_STEP * UINT32_C(2654435761)) % g->count; /* Knuth's multiplier */
    for (size_t j = 0; j < g->count; j++) {
        struct strip *s = &g->strips[(first + j) % g->count];
        const uint64_t step = (uint64_t)s->pixels * PT_CELLS_STEP;
        const int more = step <= left && goal_of(s, to, beyond) > goal_of(s, to, unit);
        s->goal = goal_of(s, to, unit) + (more ? PT_CELLS_STEP : 0);
        left -= more ? step : 0;
    }
}

void pt_cells_plan(struct pt_film *f, const struct pt_cells_wave *w, void *scratch)
{
    const int width = w->x1 - w->x0, height = w->y1 - w->y0;
    const struct grid g = {w, scratch, cells_along(width, w->cell),
                           pt_cells_scratch(width, height, w->cell) / sizeof(struct strip)};
    if (under_way(f, w))
        return;
    measure(&g, f);
    weigh(&g);
    share_out(&g);
    for (int y = w->y0; y < w->y1; y++)
        for (int x = w->x0; x < w->x1; x++)
            f->goal[pt_film_index(f, x, y)] = strip_at(&g, x, y)->goal;
}
