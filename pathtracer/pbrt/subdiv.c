/* Loop subdivision: Loop 1987, with the boundary rules and limit masks of Hoppe et al. 1994 (as in pbrt's loopsubdiv). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/pi.h"

#include "pbrt/build.h"

enum { MAX_LEVELS = 8 };
static const size_t max_triangles = (size_t)1 << 22;

/* Half edges: corner c of triangle t starts edge 3t + c towards the next corner. */
struct mesh {
    size_t vertices, triangles;
    double *p, *n;  /* [vertices][3], owns; n: of the limit surface, NULL before */
    uint32_t *v;    /* [triangles][3], owns */
    int32_t *twin;  /* [3 triangles] opposite half edge, -1 on a boundary; owns, NULL before find_neighbours */
    int32_t *start; /* [vertices] a half edge that leaves it, the one on its boundary if it has any; -1 = unused vertex */
};

static void release(struct mesh *m)
{
    free(m->p);
    free(m->n);
    free(m->v);
    free(m->twin); /* and start */
    *m = (struct mesh){0};
}

struct edge {
    uint64_t ends; /* the lower vertex, then the higher */
    int32_t half;
};

static int compare_edges(const void *a, const void *b)
{
    const struct edge *x = a, *y = b;
    if (x->ends != y->ends)
        return x->ends < y->ends ? -1 : 1;
    return x->half < y->half ? -1 : x->half > y->half;
}

static int32_t next_half(int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
static int32_t previous_half(int32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/* Sorted, the two halves of an edge are neighbours. */
static int find_neighbours(struct mesh *m)
{
    size_t n = 3 * m->triangles;
    struct edge *edges = malloc(n * sizeof *edges);
    m->twin = malloc((n + m->vertices) * sizeof *m->twin);
    if (!edges || !m->twin) {
        free(edges);
        return 0;
    }
    m->start = m->twin + n;
    for (size_t i = 0; i < n; i++) {
        uint32_t a = m->v[i], b = m->v[next_half((int32_t)i)];
        edges[i] = (struct edge){(uint64_t)(a < b ? a : b) << 32 | (a < b ? b : a), (int32_t)i};
        m->twin[i] = -1;
    }
    qsort(edges, n, sizeof *edges, compare_edges);
    for (size_t i = 0; i + 1 < n; i++)
        if (edges[i].ends == edges[i + 1].ends) {
            m->twin[edges[i].half] = edges[i + 1].half;
            m->twin[edges[i + 1].half] = edges[i].half;
            i++;
        }
    free(edges);
    for (size_t i = 0; i < m->vertices; i++)
        m->start[i] = -1;
    for (size_t i = 0; i < n; i++)
        if (m->start[m->v[i]] < 0 || m->twin[i] < 0)
            m->start[m->v[i]] = (int32_t)i;
    return 1;
}

/* Neighbours of vertex v in order: ring[0 … count). On a boundary the first and the last are its two boundary neighbours.
 * Returns the count (0 for an unused vertex or a fan that does not close), *boundary says which. */
enum { RING_MAX = 4096 }; /* the tip of a finely cut cone */
static int ring_of(const struct mesh *m, size_t v, uint32_t ring[RING_MAX], int *boundary)
{
    int count = 0;
    int32_t h = m->start[v], first = h;
    *boundary = 0;
    if (h < 0)
        return 0;
    for (;;) {
        if (count >= RING_MAX - 1 || m->v[h] != v)
            return 0;
        ring[count++] = m->v[next_half(h)];
        int32_t incoming = previous_half(h), twin = m->twin[incoming];
        if (twin < 0) {
            ring[count++] = m->v[incoming];
            *boundary = 1;
            return count;
        }
        h = twin;
        if (h == first)
            return m->twin[h] < 0 ? 0 : count;
    }
}

static double loop_beta(int valence) { return valence == 3 ? 3.0 / 16 : 3.0 / (8.0 * valence); }

static void weighted_ring(const struct mesh *m, size_t v, const uint32_t *ring, int count, double beta, double out[3])
{
    for (size_t k = 0; k < 3; k++) {
        double sum = (1 - count * beta) * m->p[3 * v + k];
        for (int i = 0; i < count; i++)
            sum += beta * m->p[3 * (size_t)ring[i] + k];
        out[k] = sum;
    }
}

static void weighted_boundary(const struct mesh *m, size_t v, uint32_t a, uint32_t b, double beta, double out[3])
{
    for (size_t k = 0; k < 3; k++)
        out[k] = (1 - 2 * beta) * m->p[3 * v + k] + beta * (m->p[3 * (size_t)a + k] + m->p[3 * (size_t)b + k]);
}

/* Across the tangents of the limit surface: Hoppe et al. 1994, appendix A, boundaries by differences along and across. Of
 * its two sides it is that of pbrt, whose rings go the other way round: against the right-hand rule. Unit, or 0. */
static void limit_normal(const struct mesh *m, const uint32_t *ring, int count, int boundary, size_t v, double out[3])
{
    double s[3] = {0, 0, 0}, t[3] = {0, 0, 0};
    for (size_t k = 0; k < 3; k++) {
        if (!boundary) {
            for (int i = 0; i < count; i++) {
                s[k] += cos(2 * BASE_PI * i / count) * m->p[3 * (size_t)ring[i] + k];
                t[k] += sin(2 * BASE_PI * i / count) * m->p[3 * (size_t)ring[i] + k];
            }
            continue;
        }
        s[k] = m->p[3 * (size_t)ring[count - 1] + k] - m->p[3 * (size_t)ring[0] + k];
        for (int i = 1; i + 1 < count; i++)
            t[k] += m->p[3 * (size_t)ring[i] + k];
        t[k] = count > 2 ? t[k] / (count - 2) - m->p[3 * v + k]
                         : m->p[3 * (size_t)ring[0] + k] + m->p[3 * (size_t)ring[1] + k] - 2 * m->p[3 * v + k];
    }
    double n[3];
    pt_cross(t, s, n);
    const double len = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (size_t k = 0; k < 3; k++)
        out[k] = len > 0 ? n[k] / len : 0;
}

/* Where vertex v goes on the next level; with a normal, on the limit surface, whose normal there it gets. */
static void move_vertex(const struct mesh *m, size_t v, double out[3], double *normal)
{
    uint32_t ring[RING_MAX];
    int boundary;
    const int count = ring_of(m, v, ring, &boundary);
    if (count < 2)
        memcpy(out, m->p + 3 * v, 3 * sizeof *out);
    else if (boundary)
        weighted_boundary(m, v, ring[0], ring[count - 1], normal ? 1.0 / 5 : 1.0 / 8, out);
    else
        weighted_ring(m, v, ring, count, normal ? 1 / (count + 3 / (8 * loop_beta(count))) : loop_beta(count), out);
    if (normal && count >= 2)
        limit_normal(m, ring, count, boundary, v, normal);
}

static void odd_vertex(const struct mesh *m, int32_t h, double out[3])
{
    size_t a = m->v[h], b = m->v[next_half(h)], c = m->v[previous_half(h)];
    int32_t twin = m->twin[h];
    for (size_t k = 0; k < 3; k++) {
        double sum = m->p[3 * a + k] + m->p[3 * b + k];
        out[k] =
            twin < 0 ? sum / 2 : 3.0 / 8 * sum + (m->p[3 * c + k] + m->p[3 * (size_t)m->v[previous_half(twin)] + k]) / 8;
    }
}

/* Of so many vertices and triangles, whose numbers are yet to come. 0 when out of memory. */
static int allocate(struct mesh *m, size_t vertices, size_t triangles)
{
    *m = (struct mesh){.vertices = vertices, .triangles = triangles};
    m->p = malloc(vertices * 3 * sizeof *m->p);
    m->v = malloc(triangles * 3 * sizeof *m->v);
    return m->p && m->v;
}

/* One level: every vertex moves, every edge gets one, every triangle becomes four. */
static int subdivide(struct mesh *m)
{
    size_t halves = 3 * m->triangles, edges = 0, at = m->vertices;
    struct mesh r = {0};
    uint32_t *middle = malloc(halves * sizeof *middle);
    int ok = middle && find_neighbours(m);
    for (size_t h = 0; ok && h < halves; h++)
        edges += m->twin[h] < (int32_t)h;
    ok = ok && allocate(&r, m->vertices + edges, 4 * m->triangles);
    for (size_t i = 0; ok && i < m->vertices; i++)
        move_vertex(m, i, r.p + 3 * i, NULL);
    /* Of the two halves of an edge the later one finds the vertex that the earlier one made. */
    for (size_t h = 0; ok && h < halves; h++) {
        int32_t twin = m->twin[h];
        if (twin >= 0 && twin < (int32_t)h) {
            middle[h] = middle[twin];
        } else {
            odd_vertex(m, (int32_t)h, r.p + 3 * at);
            middle[h] = (uint32_t)at++;
        }
    }
    for (size_t i = 0; ok && i < m->triangles; i++) {
        const uint32_t *v = m->v + 3 * i, *e = middle + 3 * i;
        const uint32_t four[12] = {v[0], e[0], e[2], e[0], v[1], e[1], e[2], e[1], v[2], e[0], e[1], e[2]};
        memcpy(r.v + 12 * i, four, sizeof four);
    }
    free(middle);
    release(m);
    *m = r;
    return ok;
}

/* Moves all vertices to the limit surface and makes normals. */
static int to_limit(struct mesh *m)
{
    double *p = malloc(m->vertices * 3 * sizeof *p);
    m->n = calloc(m->vertices, 3 * sizeof *m->n);
    int ok = p && m->n && find_neighbours(m);
    for (size_t v = 0; ok && v < m->vertices; v++)
        move_vertex(m, v, p + 3 * v, m->n + 3 * v);
    free(m->p);
    m->p = p;
    return ok;
}

int pt_build_loop_subdiv(struct pt_builder *b, struct pt_params *p)
{
    size_t vertices, corners;
    const double *P = pt_params_floats(p, "P", 3, &vertices), *indices = pt_params_ints(p, "indices", &corners);
    int levels = pt_params_int_in(p, pt_params_find(p, "nlevels") ? "nlevels" : "levels", 3, 0, MAX_LEVELS);
    struct mesh m = {0};
    int ok = 1;
    pt_params_ignore(p, "scheme");
    if (b->diag.rc)
        return b->diag.rc;
    if (!P || !indices || corners == 0 || corners % 3 != 0)
        return pt_params_fail(p, NULL, "a loopsubdiv needs \"point3 P\" and three \"integer indices\" per triangle");
    /* Before any memory is taken: each level has four times the triangles. */
    if (corners / 3 > max_triangles >> (2 * levels))
        return pt_params_fail(p, "levels", "%zu triangles subdivided %d times are too many", corners / 3, levels);
    for (size_t i = 0; i < corners; i++)
        if (pt_build_check_index(p, indices[i], vertices) != 0)
            return b->diag.rc;
    ok = allocate(&m, vertices, corners / 3);
    if (ok)
        memcpy(m.p, P, vertices * 3 * sizeof *m.p);
    for (size_t i = 0; i < corners && ok; i++)
        m.v[i] = (uint32_t)indices[i];
    for (int i = 0; i < levels && ok; i++)
        ok = subdivide(&m);
    ok = ok && to_limit(&m);
    const struct pt_soup soup = {
        .vertex_count = m.vertices, .triangle_count = m.triangles, .pd = m.p, .nd = m.n, .indices = m.v};
    if (ok)
        pt_build_mesh(b, p, &soup);
    else
        pt_diag_nomem(&b->diag, "a subdivision surface");
    release(&m);
    return b->diag.rc;
}
