#include "shade/light_tree_build.h"

#include <math.h>
#include <string.h>

enum { BUCKETS = 12 };

/* Share of |cos| averaged over all directions, for the part of a cluster whose normals cancel: 1/4 of the surface of a
 * convex body is seen from anywhere (Cauchy), 1/2 of a sheet that emits on both sides. */
static const float SEEN_OF_BODY = 0.25f, SEEN_OF_SHEET = 0.5f;

/* A run of emitters in `order`, and what bounds them together. */
struct cluster {
    int32_t begin, end;
    struct pt_light_bounds b; /* intensity: the sum */
    double net[3];            /* sum of intensity · axis over emitters with a normal */
    double any;               /* sum of intensity over those without */
};

struct build {
    const struct pt_light_bounds *bounds;
    int32_t *order; /* [count] into bounds */
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

static struct cluster single(const struct build *build, int32_t i)
{
    const struct pt_light_bounds *b = &build->bounds[build->order[i]];
    struct cluster c = {.begin = i, .end = i + 1, .b = *b};
    if (b->normals_rad >= PT_PI)
        c.any = b->intensity;
    c.net[0] = (b->intensity - c.any) * (double)b->axis.x;
    c.net[1] = (b->intensity - c.any) * (double)b->axis.y;
    c.net[2] = (b->intensity - c.any) * (double)b->axis.z;
    return c;
}

static struct cluster gather(const struct build *build, int32_t begin, int32_t end)
{
    struct cluster all = {0};
    for (int32_t i = begin; i < end; i++) {
        struct cluster one = single(build, i);
        unite(&all, &one);
    }
    all.begin = begin;
    all.end = end;
    return all;
}

/* Intensity times the measures of place and orientation (eq. 1 there): what a cluster is expected to cost in variance. The
 * square of the diagonal keeps lights in a row from having no surface. INFINITY for an empty one. */
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

static int bucket_of(const struct pt_light_bounds *b, int axis, float low, float high)
{
    int k = (int)((float)BUCKETS * ((centroid(b, axis) - low) / (high - low)));
    return k < 0 ? 0 : k >= BUCKETS ? BUCKETS - 1 : k;
}

static void centroid_range(const struct build *build, const struct cluster *c, int axis, float *low, float *high)
{
    *low = INFINITY;
    *high = -INFINITY;
    for (int32_t i = c->begin; i < c->end; i++) {
        float x = centroid(&build->bounds[build->order[i]], axis);
        *low = fminf(*low, x);
        *high = fmaxf(*high, x);
    }
}

/* Least cost over the splits between the buckets of one axis; *after: the last bucket on the left. INFINITY: none. */
static double best_on_axis(const struct build *build, const struct cluster *c, int axis, int *after)
{
    struct cluster buckets[BUCKETS] = {0}, left = {0}, right = {0};
    double right_cost[BUCKETS] = {0}, best = INFINITY;
    float low, high;
    centroid_range(build, c, axis, &low, &high);
    if (!(high > low))
        return INFINITY;
    for (int32_t i = c->begin; i < c->end; i++) {
        int k = bucket_of(&build->bounds[build->order[i]], axis, low, high);
        struct cluster one = single(build, i);
        unite(&buckets[k], &one);
    }
    for (int k = BUCKETS - 1; k > 0; k--) {
        unite(&right, &buckets[k]);
        right_cost[k] = cost(&right);
    }
    for (int k = 0; k + 1 < BUCKETS; k++) {
        unite(&left, &buckets[k]);
        double total = cost(&left) + right_cost[k + 1];
        if (total < best) {
            best = total;
            *after = k;
        }
    }
    pt_vec3 d = v3_sub(c->b.upper, c->b.lower);
    /* against thin slices: an axis costs in proportion to how short it is */
    return best * (double)(fmaxf(d.x, fmaxf(d.y, d.z)) / fmaxf(component(d, axis), 1e-30f));
}

/* Reorders the run of c, which has two emitters at least, and returns where its second half begins. */
static int32_t split(const struct build *build, const struct cluster *c)
{
    int axis = -1, after = 0;
    double least = INFINITY;
    for (int a = 0; a < 3; a++) {
        int k = 0;
        double found = best_on_axis(build, c, a, &k);
        if (found < least) {
            least = found;
            axis = a;
            after = k;
        }
    }
    if (axis < 0) /* all in one place */
        return c->begin + (c->end - c->begin) / 2;
    float low, high;
    centroid_range(build, c, axis, &low, &high);
    int32_t middle = c->begin;
    for (int32_t i = c->begin; i < c->end; i++)
        if (bucket_of(&build->bounds[build->order[i]], axis, low, high) <= after) {
            int32_t swap = build->order[i];
            build->order[i] = build->order[middle];
            build->order[middle++] = swap;
        }
    return middle > c->begin && middle < c->end ? middle : c->begin + (c->end - c->begin) / 2;
}

/* Splits the most expensive until there are PT_LIGHT_FAN of them or all are single. */
static int fan_out(const struct build *build, struct cluster all, struct cluster children[PT_LIGHT_FAN])
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
        int32_t middle = split(build, &whole);
        children[most_expensive] = gather(build, whole.begin, middle);
        children[n++] = gather(build, middle, whole.end);
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

int pt_light_tree_build(struct pt_light_tree *tree, const struct pt_light_bounds *bounds, const int32_t *ids, int32_t count,
                        int32_t emitter_count, float smallest, struct pt_arena *arena, struct pt_arena *scratch)
{
    /* each node has two children at least, so there are fewer of them than emitters */
    struct pt_light_node *nodes = pt_arena_alloc(scratch, (size_t)count, sizeof *nodes);
    struct cluster *clusters = pt_arena_alloc(scratch, (size_t)count, sizeof *clusters);
    int32_t *order = pt_arena_alloc(scratch, (size_t)count, sizeof *order);
    int32_t *places = pt_arena_alloc(arena, (size_t)emitter_count, sizeof *places);
    if (!nodes || !clusters || !order || !places)
        return 0;
    struct build build = {bounds, order};
    for (int32_t i = 0; i < count; i++)
        order[i] = i;
    for (int32_t i = 0; i < emitter_count; i++)
        places[i] = -1;
    clusters[0] = gather(&build, 0, count);
    nodes[0].parent = -1;
    tree->node_count = 1;
    for (int32_t i = 0; i < tree->node_count; i++) { /* breadth first: what is near the root lies close together */
        struct cluster children[PT_LIGHT_FAN];
        int n = fan_out(&build, clusters[i], children);
        double total = 0.0;
        for (int k = 0; k < n; k++)
            total += seen_intensity(&children[k]);
        for (int k = 0; k < PT_LIGHT_FAN; k++)
            nodes[i].radius[k] = 1.0f;
        for (int k = 0; k < n; k++) {
            fill_slot(&nodes[i], k, &children[k], total, smallest);
            if (children[k].end - children[k].begin == 1) {
                int32_t emitter = ids[order[children[k].begin]];
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
