#include "shade/light_build.h"

#include <math.h>
#include <string.h>

enum { BUCKETS = 12 };

/* Share of |cos| averaged over all directions, for the part of a cluster whose normals cancel: 1/4 of the surface of a
 * convex body is seen from anywhere (Cauchy), 1/2 of a sheet that emits on both sides. */
static const float SEEN_OF_BODY = 0.25f, SEEN_OF_SHEET = 0.5f;

/* A run of emitters, and what bounds them together. */
struct cluster {
    int32_t begin, end;       /* in the array that is being sorted */
    struct pt_light_bounds b; /* intensity: the sum */
    double net[3];            /* sum of intensity · axis over emitters with a normal */
    double any;               /* sum of intensity over those without */
};

static float angle_between(pt_vec3 a, pt_vec3 b) { return acosf(fminf(1.0f, fmaxf(-1.0f, v3_dot(a, b)))); }

/* a becomes the cone around both. */
static void unite_cones(struct pt_light_bounds *a, const struct pt_light_bounds *b)
{
    const struct pt_light_bounds *wide = a->normals_rad >= b->normals_rad ? a : b, *other = wide == a ? b : a;
    float between = angle_between(wide->axis, other->axis), half = wide->normals_rad;
    pt_vec3 axis = wide->axis;
    if (fminf(between + other->normals_rad, PT_PI) > half) {
        half = 0.5f * (wide->normals_rad + between + other->normals_rad);
        /* turns the axis towards the other one until the cone touches both */
        pt_vec3 across = v3_norm(v3_madd(other->axis, -v3_dot(wide->axis, other->axis), wide->axis));
        float turn = half - wide->normals_rad;
        if (half >= PT_PI || v3_is_black(across))
            half = PT_PI;
        else
            axis = v3_norm(v3_madd(v3_scale(wide->axis, cosf(turn)), sinf(turn), across));
    }
    a->axis = axis;
    a->normals_rad = half;
    a->emission_rad = fmaxf(a->emission_rad, b->emission_rad);
}

/* *a with what *b has. Either may be empty: its end is 0. */
static void unite(struct cluster *a, const struct cluster *b)
{
    if (b->end == 0)
        return;
    if (a->end == 0) {
        *a = *b;
        return;
    }
    a->b.lower = v3_least(a->b.lower, b->b.lower);
    a->b.upper = v3_most(a->b.upper, b->b.upper);
    unite_cones(&a->b, &b->b);
    a->b.two_sided |= b->b.two_sided;
    a->b.intensity += b->b.intensity;
    for (int i = 0; i < 3; i++)
        a->net[i] += b->net[i];
    a->any += b->any;
}

/* Adds emitter i of `bounds` to *c. */
static void add(struct cluster *c, const struct pt_light_bounds *bounds, int32_t i)
{
    struct cluster one = {.begin = i, .end = i + 1, .b = bounds[i]};
    if (one.b.normals_rad >= PT_PI)
        one.any = one.b.intensity;
    one.net[0] = (one.b.intensity - one.any) * (double)one.b.axis.x;
    one.net[1] = (one.b.intensity - one.any) * (double)one.b.axis.y;
    one.net[2] = (one.b.intensity - one.any) * (double)one.b.axis.z;
    unite(c, &one);
}

static struct cluster gather(const struct pt_light_bounds *bounds, int32_t begin, int32_t end)
{
    struct cluster all = {0};
    for (int32_t i = begin; i < end; i++)
        add(&all, bounds, i);
    all.begin = begin;
    all.end = end;
    return all;
}

/* Intensity times the measures of place and orientation (Conty Estevez & Kulla 2018, eq. 1): what a cluster is expected to
 * cost in variance. The square of the diagonal keeps lights in a row from having no surface. INFINITY for an empty one. */
static double cost(const struct cluster *c)
{
    if (c->end == 0)
        return INFINITY;
    pt_vec3 d = v3_sub(c->b.upper, c->b.lower);
    double area = 2.0 * ((double)d.x * (double)d.y + (double)d.y * (double)d.z + (double)d.z * (double)d.x);
    double o = (double)c->b.normals_rad, w = fmin(o + (double)c->b.emission_rad, (double)PT_PI);
    double solid = 2.0 * (double)PT_PI * (1.0 - cos(o)) +
                   0.5 * (double)PT_PI * (2.0 * w * sin(o) - cos(o - 2.0 * w) - 2.0 * o * sin(o) + cos(o));
    return c->b.intensity * (area + 0.01 * (double)v3_dot(d, d)) * solid;
}

static float component(pt_vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

static float centroid(const struct pt_light_bounds *b, int axis)
{
    return 0.5f * component(b->lower, axis) + 0.5f * component(b->upper, axis);
}

/* A way to split a cluster: at the end of bucket `after` of those between the least and the greatest centroid on an axis. */
struct cut {
    int axis, after;
    float low, high;
    double cost; /* INFINITY: there is none */
};

static int bucket_of(const struct pt_light_bounds *b, const struct cut *cut)
{
    int k = (int)((float)BUCKETS * ((centroid(b, cut->axis) - cut->low) / (cut->high - cut->low)));
    return k < 0 ? 0 : k >= BUCKETS ? BUCKETS - 1 : k;
}

/* The way of least cost on one axis. */
static struct cut best_on_axis(const struct pt_light_bounds *bounds, const struct cluster *c, int axis)
{
    struct cluster buckets[BUCKETS] = {0}, left = {0}, right = {0};
    double right_cost[BUCKETS] = {0};
    struct cut best = {.axis = axis, .low = INFINITY, .high = -INFINITY, .cost = INFINITY};
    for (int32_t i = c->begin; i < c->end; i++) {
        best.low = fminf(best.low, centroid(&bounds[i], axis));
        best.high = fmaxf(best.high, centroid(&bounds[i], axis));
    }
    if (!(best.high > best.low))
        return best;
    for (int32_t i = c->begin; i < c->end; i++)
        add(&buckets[bucket_of(&bounds[i], &best)], bounds, i);
    for (int k = BUCKETS - 1; k > 0; k--) {
        unite(&right, &buckets[k]);
        right_cost[k] = cost(&right);
    }
    for (int k = 0; k + 1 < BUCKETS; k++) {
        unite(&left, &buckets[k]);
        double total = cost(&left) + right_cost[k + 1];
        if (total < best.cost) {
            best.cost = total;
            best.after = k;
        }
    }
    pt_vec3 d = v3_sub(c->b.upper, c->b.lower);
    /* against thin slices: an axis costs in proportion to how short it is */
    best.cost *= (double)(fmaxf(d.x, fmaxf(d.y, d.z)) / fmaxf(component(d, axis), 1e-30f));
    return best;
}

/* Reorders the run of c, which has two emitters at least, and returns where its second half begins. */
static int32_t split(struct pt_light_bounds *bounds, const struct cluster *c)
{
    struct cut best = {.cost = INFINITY};
    for (int axis = 0; axis < 3; axis++) {
        const struct cut cut = best_on_axis(bounds, c, axis);
        if (cut.cost < best.cost)
            best = cut;
    }
    int32_t middle = c->begin;
    for (int32_t i = c->begin; i < c->end && best.cost < INFINITY; i++)
        if (bucket_of(&bounds[i], &best) <= best.after) {
            struct pt_light_bounds swap = bounds[i];
            bounds[i] = bounds[middle];
            bounds[middle++] = swap;
        }
    /* all in one place, or on one side by rounding: by number */
    return middle > c->begin && middle < c->end ? middle : c->begin + (c->end - c->begin) / 2;
}

/* Splits the most expensive until there are PT_LIGHT_FAN of them or all are single. */
static int fan_out(struct pt_light_bounds *bounds, struct cluster all, struct cluster children[PT_LIGHT_FAN])
{
    int n = 1;
    children[0] = all;
    while (n < PT_LIGHT_FAN) {
        int most_expensive = -1;
        for (int k = 0; k < n; k++)
            if (children[k].end - children[k].begin > 1 &&
                (most_expensive < 0 || cost(&children[k]) > cost(&children[most_expensive])))
                most_expensive = k;
        if (most_expensive < 0)
            break;
        struct cluster whole = children[most_expensive];
        int32_t middle = split(bounds, &whole);
        children[most_expensive] = gather(bounds, whole.begin, middle);
        children[n++] = gather(bounds, middle, whole.end);
    }
    return n;
}

/* What a cluster of normals that point all ways sends one way is less than the sum over its emitters. */
static double seen_intensity(const struct cluster *c)
{
    double net = sqrt(c->net[0] * c->net[0] + c->net[1] * c->net[1] + c->net[2] * c->net[2]);
    double rest = fmax(0.0, c->b.intensity - c->any - net);
    return c->any + net + rest * (double)(c->b.two_sided ? SEEN_OF_SHEET : SEEN_OF_BODY);
}

static void fill_slot(struct pt_light_node *n, int k, const struct cluster *c, double total, float smallest)
{
    pt_vec3 half = v3_scale(v3_sub(c->b.upper, c->b.lower), 0.5f), centre = v3_add(c->b.lower, half);
    n->centre_x[k] = centre.x;
    n->centre_y[k] = centre.y;
    n->centre_z[k] = centre.z;
    n->radius[k] = fmaxf(v3_len(half), smallest);
    n->axis_x[k] = c->b.axis.x;
    n->axis_y[k] = c->b.axis.y;
    n->axis_z[k] = c->b.axis.z;
    n->cos_normals[k] = c->b.normals_rad >= PT_PI ? -1.0f : cosf(c->b.normals_rad);
    n->sin_normals[k] = c->b.normals_rad >= PT_PI ? 0.0f : sinf(c->b.normals_rad);
    n->cos_emission[k] = c->b.emission_rad >= 0.5f * PT_PI ? 0.0f : cosf(c->b.emission_rad);
    n->two_sided[k] = -(c->b.two_sided != 0);
    n->intensity[k] = (float)(seen_intensity(c) / total);
}

int pt_light_tree_build(struct pt_light_tree *tree, struct pt_light_bounds *bounds, int32_t count, int32_t emitter_count,
                        float smallest, struct pt_arena *arena, struct pt_arena *scratch)
{
    /* each node has two children at least, so there are fewer of them than emitters */
    struct pt_light_node *nodes = pt_arena_alloc(scratch, (size_t)count, sizeof *nodes);
    struct cluster *clusters = pt_arena_alloc(scratch, (size_t)count, sizeof *clusters);
    int32_t *places = pt_arena_alloc(arena, (size_t)emitter_count, sizeof *places);
    if (!nodes || !clusters || !places)
        return 0;
    for (int32_t i = 0; i < emitter_count; i++)
        places[i] = -1;
    clusters[0] = gather(bounds, 0, count);
    nodes[0].parent = -1;
    tree->node_count = 1;
    for (int32_t i = 0; i < tree->node_count; i++) { /* breadth first: what is near the root lies close together */
        struct cluster children[PT_LIGHT_FAN];
        int n = fan_out(bounds, clusters[i], children);
        double total = 0.0;
        for (int k = 0; k < n; k++)
            total += seen_intensity(&children[k]);
        for (int k = 0; k < PT_LIGHT_FAN; k++)
            nodes[i].radius[k] = 1.0f;
        for (int k = 0; k < n; k++) {
            fill_slot(&nodes[i], k, &children[k], total, smallest);
            if (children[k].end - children[k].begin == 1) {
                int32_t emitter = bounds[children[k].begin].emitter;
                nodes[i].child[k] = ~emitter;
                places[emitter] = PT_LIGHT_FAN * i + k;
                continue;
            }
            nodes[i].child[k] = tree->node_count;
            nodes[tree->node_count].parent = PT_LIGHT_FAN * i + k;
            clusters[tree->node_count++] = children[k];
        }
    }
    tree->places = places;
    tree->nodes = pt_arena_alloc(arena, (size_t)tree->node_count, sizeof *nodes);
    if (!tree->nodes)
        return 0;
    memcpy(tree->nodes, nodes, (size_t)tree->node_count * sizeof *nodes);
    return 1;
}
