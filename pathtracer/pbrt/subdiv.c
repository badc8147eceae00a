/* Loop subdivision: Loop 1987, with the boundary rules and limit masks of Hoppe et al. 1994 (as in pbrt's loopsubdiv). */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/pi.h"

#include "pbrt/build.h"

enum { MAX_LEVELS = 8 };
static const size_t max_triangles = (size_t)1 << 22;

struct mesh {
    size_t vertices, triangles;
    double *p;   /* [vertices][3], owns */
    uint32_t *v; /* [triangles][3], owns */
};

/* Half edges: corner c of triangle t starts edge 3t + c towards the next corner. */
struct topology {
    int32_t *twin;  /* opposite half edge, -1 on a boundary */
    int32_t *start; /* a half edge leaving each vertex, the one on its boundary if it has any; -1 = unused vertex */
};

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
static int build_topology(const struct mesh *m, struct topology *t)
{
    size_t n = 3 * m->triangles;
    struct edge *edges = malloc(n * sizeof *edges);
    t->twin = malloc(n * sizeof *t->twin);
    t->start = malloc(m->vertices * sizeof *t->start);
    if (!edges || !t->twin || !t->start) {
        free(edges);
        return 0;
    }
    for (size_t i = 0; i < n; i++) {
        uint32_t a = m->v[i], b = m->v[next_half((int32_t)i)];
        edges[i] = (struct edge){(uint64_t)(a < b ? a : b) << 32 | (a < b ? b : a), (int32_t)i};
        t->twin[i] = -1;
    }
    qsort(edges, n, sizeof *edges, compare_edges);
    for (size_t i = 0; i + 1 < n; i++)
        if (edges[i].ends == edges[i + 1].ends) {
            t->twin[edges[i].half] = edges[i + 1].half;
            t->twin[edges[i + 1].half] = edges[i].half;
            i++;
        }
    free(edges);
    for (size_t i = 0; i < m->vertices; i++)
        t->start[i] = -1;
    for (size_t i = 0; i < n; i++)
        if (t->start[m->v[i]] < 0 || t->twin[i] < 0)
            t->start[m->v[i]] = (int32_t)i;
    return 1;
}

/* Neighbours of vertex v in order: ring[0 … count). On a boundary the first and the last are its two boundary neighbours.
 * Returns the count (0 for an unused vertex or a fan that does not close), *boundary says which. */
enum { RING_MAX = 4096 }; /* the tip of a finely cut cone */
static int ring_of(const struct mesh *m, const struct topology *t, size_t v, uint32_t ring[RING_MAX], int *boundary)
{
    int count = 0;
    int32_t h = t->start[v], first = h;
    *boundary = 0;
    if (h < 0)
        return 0;
    for (;;) {
        if (count >= RING_MAX - 1 || m->v[h] != v)
            return 0;
        ring[count++] = m->v[next_half(h)];
        int32_t incoming = previous_half(h), twin = t->twin[incoming];
        if (twin < 0) {
            ring[count++] = m->v[incoming];
            *boundary = 1;
            return count;
        }
        h = twin;
        if (h == first)
            return t->twin[h] < 0 ? 0 : count;
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

/* Where vertex v goes on the next level, or on the limit surface; gives its ring as ring_of does. */
static int move_vertex(const struct mesh *m, const struct topology *t, size_t v, int to_limit, uint32_t ring[RING_MAX],
                       int *boundary, double out[3])
{
    const int count = ring_of(m, t, v, ring, boundary);
    if (count < 2)
        memcpy(out, m->p + 3 * v, 3 * sizeof *out);
    else if (*boundary)
        weighted_boundary(m, v, ring[0], ring[count - 1], to_limit ? 1.0 / 5 : 1.0 / 8, out);
    else
        weighted_ring(m, v, ring, count, to_limit ? 1 / (count + 3 / (8 * loop_beta(count))) : loop_beta(count), out);
    return count;
}

static void odd_vertex(const struct mesh *m, const struct topology *t, int32_t h, double out[3])
{
    size_t a = m->v[h], b = m->v[next_half(h)], c = m->v[previous_half(h)];
    int32_t twin = t->twin[h];
    for (size_t k = 0; k < 3; k++) {
        double sum = m->p[3 * a + k] + m->p[3 * b + k];
        out[k] =
            twin < 0 ? sum / 2 : 3.0 / 8 * sum + (m->p[3 * c + k] + m->p[3 * (size_t)m->v[previous_half(twin)] + k]) / 8;
    }
}

/* One level: every vertex moves, every edge gets one, every triangle becomes four. */
static int subdivide(struct mesh *m)
{
    struct topology t = {0};
    struct mesh r = {.triangles = 4 * m->triangles};
    size_t halves = 3 * m->triangles, edges = 0;
    uint32_t *middle = malloc(halves * sizeof *middle);
    int ok = middle && build_topology(m, &t);
    for (size_t h = 0; ok && h < halves; h++)
        edges += t.twin[h] < (int32_t)h;
    r.vertices = m->vertices + edges;
    if (ok) {
        r.p = malloc(r.vertices * 3 * sizeof *r.p);
        r.v = malloc(r.triangles * 3 * sizeof *r.v);
        ok = r.p && r.v;
    }
    for (size_t i = 0; ok && i < m->vertices; i++) {
        uint32_t ring[RING_MAX];
        int boundary;
        move_vertex(m, &t, i, 0, ring, &boundary, r.p + 3 * i);
    }
    size_t at = m->vertices;
    /* Of the two halves of an edge the later one finds the vertex that the earlier one made. */
    for (size_t h = 0; ok && h < halves; h++) {
        int32_t twin = t.twin[h];
        if (twin >= 0 && twin < (int32_t)h) {
            middle[h] = middle[twin];
        } else {
            odd_vertex(m, &t, (int32_t)h, r.p + 3 * at);
            middle[h] = (uint32_t)at++;
        }
    }
    for (size_t i = 0; ok && i < m->triangles; i++) {
        const uint32_t *v = m->v + 3 * i, *e = middle + 3 * i;
        const uint32_t four[12] = {v[0], e[0], e[2], e[0], v[1], e[1], e[2], e[1], v[2], e[0], e[1], e[2]};
        memcpy(r.v + 12 * i, four, sizeof four);
    }
    free(middle);
    free(t.twin);
    free(t.start);
    if (!ok) {
        free(r.p);
        free(r.v);
        return 0;
    }
    free(m->p);
    free(m->v);
    *m = r;
    return 1;
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

/* Moves all vertices to the limit surface and makes normals; [vertices][3], malloc'ed. */
static double *to_limit(struct mesh *m)
{
    struct topology t = {0};
    double *normals = calloc(m->vertices, 3 * sizeof *normals), *p = malloc(m->vertices * 3 * sizeof *p);
    int ok = normals && p && build_topology(m, &t);
    for (size_t v = 0; ok && v < m->vertices; v++) {
        uint32_t ring[RING_MAX];
        int boundary, count = move_vertex(m, &t, v, 1, ring, &boundary, p + 3 * v);
        if (count >= 2)
            limit_normal(m, ring, count, boundary, v, normals + 3 * v);
    }
    free(t.twin);
    free(t.start);
    if (!ok) {
        free(p);
        free(normals);
        return NULL;
    }
    free(m->p);
    m->p = p;
    return normals;
}

int pt_build_loop_subdiv(struct pt_builder *b, struct pt_params *p)
{
    size_t vertices, corners;
    const double *P = pt_params_floats(p, "P", 3, &vertices), *indices = pt_params_ints(p, "indices", &corners);
    int levels = pt_params_int_in(p, pt_params_find(p, "nlevels") ? "nlevels" : "levels", 3, 0, MAX_LEVELS);
    struct mesh m = {0};
    double *normals = NULL;
    pt_params_ignore(p, "scheme");
    if (b->diag.rc)
        return b->diag.rc;
    if (!P || !indices || corners == 0 || corners % 3 != 0)
        return pt_params_fail(p, NULL, "a loopsubdiv needs \"point3 P\" and three \"integer indices\" per triangle");
    /* Before any memory is taken: each level has four times the triangles. */
    if (corners / 3 > max_triangles >> (2 * levels))
        return pt_params_fail(p, "levels", "%zu triangles subdivided %d times are too many", corners / 3, levels);
    m = (struct mesh){vertices, corners / 3, malloc(vertices * 3 * sizeof *m.p), malloc(corners * sizeof *m.v)};
    if (!m.p || !m.v) {
        pt_diag_nomem(&b->diag, "a subdivision surface");
        goto out;
    }
    memcpy(m.p, P, vertices * 3 * sizeof *m.p);
    for (size_t i = 0; i < corners; i++) {
        if (pt_build_check_index(p, indices[i], vertices) != 0)
            goto out;
        m.v[i] = (uint32_t)indices[i];
    }
    int ok = 1;
    for (int i = 0; i < levels && ok; i++)
        ok = subdivide(&m);
    normals = ok ? to_limit(&m) : NULL;
    if (!normals) {
        pt_diag_nomem(&b->diag, "a subdivision surface");
        goto out;
    }
    struct pt_soup soup = {
        .vertex_count = m.vertices, .triangle_count = m.triangles, .pd = m.p, .nd = normals, .indices = m.v};
    pt_build_mesh(b, p, &soup);
out:
    free(m.p);
    free(m.v);
    free(normals);
    return b->diag.rc;
}
