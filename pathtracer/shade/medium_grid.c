/*
 * Media of varying density: null-collision tracking. Tentative collisions are drawn from a piecewise-constant majorant that
 * is walked cell by cell (Amanatides and Woo 1987); ratio tracking for transmittance (Novák et al. 2014), weighted delta
 * tracking for collisions (Kutz et al. 2017: colours share one majorant and absorption goes into the weight).
 */
#include "shade/medium.h"

enum { MAJORANT_CELLS = 16 /* largest number per axis */ };

/* Below this weight a path or transmittance is ended at random. */
static const float roulette_below = 0.05f;

static float cell(const struct pt_medium *m, int x, int y, int z)
{
    if (x < 0 || y < 0 || z < 0 || x >= m->nx || y >= m->ny || z >= m->nz)
        return 0.0f;
    return m->density[((size_t)z * (size_t)m->ny + (size_t)y) * (size_t)m->nx + (size_t)x];
}

static float lerp(float a, float b, float t) { return (1.0f - t) * a + t * b; }

float pt_medium_density(const struct pt_medium *m, pt_vec3 p)
{
    if (!(p.x >= 0.0f && p.x <= 1.0f && p.y >= 0.0f && p.y <= 1.0f && p.z >= 0.0f && p.z <= 1.0f))
        return 0.0f;
    float fx = p.x * (float)m->nx - 0.5f, fy = p.y * (float)m->ny - 0.5f, fz = p.z * (float)m->nz - 0.5f;
    int x = (int)floorf(fx), y = (int)floorf(fy), z = (int)floorf(fz);
    float dx = fx - (float)x, dy = fy - (float)y, dz = fz - (float)z;
    float c00 = lerp(cell(m, x, y, z), cell(m, x + 1, y, z), dx);
    float c10 = lerp(cell(m, x, y + 1, z), cell(m, x + 1, y + 1, z), dx);
    float c01 = lerp(cell(m, x, y, z + 1), cell(m, x + 1, y, z + 1), dx);
    float c11 = lerp(cell(m, x, y + 1, z + 1), cell(m, x + 1, y + 1, z + 1), dx);
    return lerp(lerp(c00, c10, dy), lerp(c01, c11, dy), dz);
}

/* Density cells that trilinear lookups in majorant cell i of n (over `count` density cells) can touch. */
static void touched(int i, int n, int count, int *first, int *last)
{
    int a = (int)floorf((float)i / (float)n * (float)count - 0.501f);
    int b = (int)floorf((float)(i + 1) / (float)n * (float)count - 0.499f) + 1;
    *first = a < 0 ? 0 : a;
    *last = b >= count ? count - 1 : b;
}

static float largest(const struct pt_medium *m, int x, int y, int z)
{
    int x0, x1, y0, y1, z0, z1;
    touched(x, m->mx, m->nx, &x0, &x1);
    touched(y, m->my, m->ny, &y0, &y1);
    touched(z, m->mz, m->nz, &z0, &z1);
    float best = 0.0f;
    for (int k = z0; k <= z1; k++)
        for (int j = y0; j <= y1; j++)
            for (int i = x0; i <= x1; i++)
                best = fmaxf(best, cell(m, i, j, k));
    return best;
}

int pt_medium_grid_build(struct pt_medium *m, struct pt_arena *arena, struct base_err *err)
{
    m->mx = m->nx < MAJORANT_CELLS ? m->nx : MAJORANT_CELLS;
    m->my = m->ny < MAJORANT_CELLS ? m->ny : MAJORANT_CELLS;
    m->mz = m->nz < MAJORANT_CELLS ? m->nz : MAJORANT_CELLS;
    float *majorant = pt_arena_alloc(arena, (size_t)m->mx * (size_t)m->my * (size_t)m->mz, sizeof(float));
    if (!majorant)
        return base_fail_nomem(err, "the majorants of a grid medium");
    m->majorant = majorant;
    for (int z = 0; z < m->mz; z++)
        for (int y = 0; y < m->my; y++)
            for (int x = 0; x < m->mx; x++)
                majorant[(z * m->my + y) * m->mx + x] = largest(m, x, y, z);
    return 0;
}

/* A ray on its way through the majorant cells. */
struct walk {
    pt_vec3 origin, direction; /* in the unit box; t as outside */
    float t, t_end;
    float next[3], delta[3]; /* t of the next face per axis, t between faces */
    int index[3], step[3], count[3];
    float majorant; /* of the current cell, 1/scene unit */
    float sigma;    /* largest extinction channel at density 1 */
};

static void walk_load(struct walk *w, const struct pt_medium *m)
{
    w->majorant = w->sigma * m->majorant[(w->index[2] * m->my + w->index[1]) * m->mx + w->index[0]];
}

/* 0 when the ray misses the box within [0, t_max]. */
static int walk_start(struct walk *w, const struct pt_medium *m, pt_vec3 origin, pt_vec3 direction, float t_max)
{
    w->origin = pt_mat34_point(&m->from_render, origin);
    w->direction = pt_mat34_vector(&m->from_render, direction);
    w->sigma = v3_max(v3_add(m->sigma_a, m->sigma_s));
    const float o[3] = {w->origin.x, w->origin.y, w->origin.z}, d[3] = {w->direction.x, w->direction.y, w->direction.z};
    /* the part of the ray between all pairs of faces; a ray along a pair is between the two all the way or nowhere */
    float t0 = 0.0f, t1 = t_max;
    for (int a = 0; a < 3; a++) {
        if (d[a] == 0.0f) {
            if (!(o[a] >= 0.0f && o[a] <= 1.0f))
                return 0;
            continue;
        }
        float ta = -o[a] / d[a], tb = (1.0f - o[a]) / d[a];
        t0 = fmaxf(t0, fminf(ta, tb));
        t1 = fminf(t1, fmaxf(ta, tb));
    }
    if (!(t0 < t1 && isfinite(t1)))
        return 0;
    /* the cell that it enters in, clamped: rounding may put that point outside */
    w->t = t0;
    w->t_end = t1;
    w->count[0] = m->mx;
    w->count[1] = m->my;
    w->count[2] = m->mz;
    for (int a = 0; a < 3; a++) {
        float n = (float)w->count[a], at = (o[a] + t0 * d[a]) * n;
        int i = at > 0.0f ? (int)fminf(at, n - 1.0f) : 0;
        w->index[a] = i;
        w->step[a] = d[a] > 0.0f ? 1 : -1;
        w->next[a] = d[a] == 0.0f ? INFINITY : ((float)(i + (d[a] > 0.0f)) / n - o[a]) / d[a];
        w->delta[a] = d[a] == 0.0f ? INFINITY : 1.0f / (fabsf(d[a]) * n);
    }
    walk_load(w, m);
    return 1;
}

/* Moves to the next tentative collision, at w->t; 0 when the ray leaves the box or reaches its end first. */
static int walk_next(struct walk *w, const struct pt_medium *m, struct pt_rng *rng)
{
    float depth = -log1pf(-pt_rng_float(rng)); /* optical distance to go */
    for (;;) {
        int a = w->next[0] < w->next[1] ? (w->next[0] < w->next[2] ? 0 : 2) : (w->next[1] < w->next[2] ? 1 : 2);
        float end = fminf(w->next[a], w->t_end), here = w->majorant * fmaxf(0.0f, end - w->t);
        if (depth < here) {
            w->t += depth / w->majorant;
            return 1;
        }
        depth -= here;
        w->t = fmaxf(w->t, end);
        if (end >= w->t_end)
            return 0;
        w->index[a] += w->step[a];
        if (w->index[a] < 0 || w->index[a] >= w->count[a])
            return 0;
        w->next[a] += w->delta[a];
        walk_load(w, m);
    }
}

/* Ends faint weights at random without bias; 0 = ended. */
static int survive(pt_vec3 *weight, struct pt_rng *rng)
{
    float w = v3_max(*weight);
    if (w >= roulette_below)
        return 1;
    if (!(w > 0.0f) || pt_rng_float(rng) >= w) {
        *weight = v3_splat(0.0f);
        return 0;
    }
    *weight = v3_scale(*weight, 1.0f / w);
    return 1;
}

void pt_medium_grid_sample(const struct pt_medium *m, pt_vec3 origin, pt_vec3 direction, float t_max, pt_vec3 throughput,
                           struct pt_rng *rng, struct pt_medium_event *event)
{
    struct walk w;
    pt_vec3 weight = v3_splat(1.0f), emitted = v3_splat(0.0f), sigma_t = v3_add(m->sigma_a, m->sigma_s);
    event->scattered = 0;
    event->t = t_max;
    if (walk_start(&w, m, origin, direction, t_max)) {
        while (walk_next(&w, m, rng)) {
            float share = pt_medium_density(m, v3_madd(w.origin, w.t, w.direction)) / w.majorant;
            emitted = v3_madd(emitted, share, v3_mul(weight, m->emission));
            pt_vec3 scatter = v3_scale(m->sigma_s, share), null = v3_sub(v3_splat(1.0f), v3_scale(sigma_t, share));
            null = v3_most(null, v3_splat(0.0f));
            pt_vec3 carried = v3_mul(throughput, weight);
            /* scattering or a null collision by what the path would carry on; both black: all of it is absorbed */
            float ps = v3_dot(carried, scatter), pn = v3_dot(carried, null);
            if (!(ps + pn > 0.0f)) {
                weight = v3_splat(0.0f);
                break;
            }
            ps /= ps + pn;
            if (pt_rng_float(rng) < ps) {
                weight = v3_scale(v3_mul(weight, scatter), 1.0f / ps);
                event->scattered = 1;
                event->t = w.t;
                break;
            }
            weight = v3_scale(v3_mul(weight, null), 1.0f / (1.0f - ps));
            if (!survive(&weight, rng))
                break;
        }
    }
    event->weight = weight;
    event->emitted = emitted;
}

pt_vec3 pt_medium_grid_transmittance(const struct pt_medium *m, pt_vec3 origin, pt_vec3 direction, float t_max,
                                     struct pt_rng *rng)
{
    struct walk w;
    pt_vec3 weight = v3_splat(1.0f), sigma_t = v3_add(m->sigma_a, m->sigma_s);
    if (!walk_start(&w, m, origin, direction, t_max))
        return weight;
    while (walk_next(&w, m, rng)) {
        float share = pt_medium_density(m, v3_madd(w.origin, w.t, w.direction)) / w.majorant;
        weight = v3_mul(weight, v3_sub(v3_splat(1.0f), v3_scale(sigma_t, share)));
        weight = v3_most(weight, v3_splat(0.0f));
        if (!survive(&weight, rng))
            break;
    }
    return weight;
}
