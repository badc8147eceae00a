#include "shade/light_build.h"

#include <math.h>
#include <stdlib.h>

#include "base/pi.h"
#include "geom/quadric.h"
#include "sample/rng.h"
#include "scene/settings.h"
#include "shade/light_area.h"
#include "shade/light_env.h"

/* Share of the selection probability that is spread evenly over the finite lights, so that a weak lamp near the camera is
 * not starved by strong ones elsewhere. */
#define UNIFORM_SHARE 0.2
/* The same in the hierarchy, which looks after near lamps itself: for strong ones nearer by but hidden. */
#define TREE_UNIFORM_SHARE 0.05
/* A hierarchy needs this many lights that are somewhere. */
enum { TREE_LIGHTS = 2 };
/* With so few emitters it is looked, at so many places, whether the hierarchy is worth its time: below WORTH (see advantage)
 * scenes measured worse with it than by power, above it better (docs/results/speed.md). */
enum { FEW = 64, PROBES = 512 };
static const double WORTH = 1.06;
/* Least radius of a node relative to the scene: importance is finite in a point light. */
#define SMALLEST_NODE 1e-6f
/* Radians by which a spot's cone is widened against rounding. */
#define SPOT_SLACK 2e-3f

static int at_infinity(const struct pt_light *light)
{
    return light->kind == PT_LIGHT_ENV_IMAGE || light->kind == PT_LIGHT_ENV_CONSTANT || light->kind == PT_LIGHT_DISTANT;
}

static int32_t emitters_of(const struct pt_scene *scene, const struct pt_light *light)
{
    if (light->kind == PT_LIGHT_ENV_CONSTANT && !light->has_portal)
        return 0;
    if (light->kind != PT_LIGHT_AREA || scene->shapes[light->shape].kind == PT_SHAPE_QUADRIC)
        return 1;
    return (int32_t)scene->meshes[scene->shapes[light->shape].data].triangle_count;
}

/* Corners whose normals are on both sides of their triangle: each point of it emits to the side of its interpolated normal,
 * as pt_place_mesh has it. */
static void point_sides(pt_vec3 a, pt_vec3 b, pt_vec3 c, struct pt_emitter *e)
{
    float at_a = v3_dot(a, e->n), at_b = v3_dot(b, e->n), at_c = v3_dot(c, e->n);
    if (fminf(at_a, fminf(at_b, at_c)) < 0.0f && fmaxf(at_a, fmaxf(at_b, at_c)) > 0.0f)
        e->side = v3(at_a, at_b - at_a, at_c - at_a);
}

/* Whether a triangle emits to one side here and to the other there. */
static int has_two_sides(const struct pt_emitter *e) { return e->side.y != 0.0f || e->side.z != 0.0f; }

/* Geometry of one triangle of a mesh light; returns its area. */
static double triangle_emitter(const struct pt_scene *scene, const struct pt_shape *shape, int32_t primitive,
                               struct pt_emitter *e)
{
    const struct pt_mesh *mesh = &scene->meshes[shape->data];
    const uint32_t *index = mesh->indices + 3 * (size_t)primitive;
    const struct pt_vertex *a = mesh->vertices + index[0], *b = mesh->vertices + index[1], *c = mesh->vertices + index[2];
    e->p0 = a->p;
    e->e1 = v3_sub(b->p, a->p);
    e->e2 = v3_sub(c->p, a->p);
    pt_vec3 n = v3_cross(e->e1, e->e2);
    double area = 0.5 * sqrt((double)n.x * (double)n.x + (double)n.y * (double)n.y + (double)n.z * (double)n.z);
    e->n = area > 0.0 ? v3_scale(n, (float)(0.5 / area)) : v3_splat(0.0f);
    e->area_over_pmf = (float)area; /* divided by the pmf once that is known */
    float side = mesh->has_normals ? v3_dot(v3_add(a->n, v3_add(b->n, c->n)), n) : 0.0f;
    if (side != 0.0f ? side < 0.0f : shape->flip_normal)
        e->n = v3_neg(e->n);
    e->side = v3(1.0f, 0.0f, 0.0f);
    if (mesh->has_normals)
        point_sides(a->n, b->n, c->n, e);
    return isfinite(e->area_over_pmf) ? area : 0.0;
}

/* Radiant power up to a common factor (luminance). */
static double power_of(const struct pt_scene *scene, const struct pt_light *light, double area)
{
    double l = (double)v3_luminance(light->emission);
    /* a bad value must still be selected, so that it is met and counted */
    l = !isfinite(l) ? 1.0 : l > 0.0 ? l : 0.0;
    pt_vec3 d = v3_sub(scene->bounds_max, scene->bounds_min);
    double disk = BASE_PI * 0.25 * (double)v3_dot(d, d);
    switch (light->kind) {
    case PT_LIGHT_AREA: return BASE_PI * area * l * (light->two_sided ? 2.0 : 1.0);
    case PT_LIGHT_ENV_IMAGE:
    case PT_LIGHT_ENV_CONSTANT: return 4.0 * BASE_PI * disk * (double)pt_light_env_mean(scene, light);
    case PT_LIGHT_DISTANT: return disk * l;
    case PT_LIGHT_SPOT: return 2.0 * BASE_PI * l * (1.0 - 0.5 * (light->cos_total + light->cos_start));
    case PT_LIGHT_POINT: return 4.0 * BASE_PI * l;
    default: return 0.0;
    }
}

/* Fills geometry and weights (power) of the emitters of all lights. */
static void fill(struct pt_scene *scene, double *weights)
{
    int32_t n = 0;
    for (int32_t i = 0; i < scene->light_count; i++) {
        struct pt_light *light = &scene->lights[i];
        int32_t count = emitters_of(scene, light);
        light->first_emitter = n;
        for (int32_t k = 0; k < count; k++, n++) {
            struct pt_emitter *e = &scene->emitters[n];
            const struct pt_shape *shape = light->kind == PT_LIGHT_AREA ? &scene->shapes[light->shape] : NULL;
            double area = 0.0;
            e->light = i;
            e->primitive = shape && shape->kind == PT_SHAPE_MESH ? k : -1;
            if (e->primitive >= 0)
                area = triangle_emitter(scene, shape, k, e);
            else if (shape)
                area = pt_light_quadric_area(&scene->quadrics[shape->data]);
            weights[n] = power_of(scene, light, area);
        }
    }
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What the lights at infinity and the others share of the probability. */
struct shares {
    double far;   /* of each emitter at infinity that emits at all */
    double near;  /* of all others together */
    double power; /* of those */
    int far_count, near_lights;
};

/* Every light at infinity gets 1/(1 + number of them) when there are finite ones too: its power depends on the scene's size,
 * not on what it does to the image. */
static struct shares share_out(const struct pt_scene *scene, const double *weights)
{
    struct shares s = {0};
    for (int32_t i = 0; i < scene->emitter_count; i++) {
        int far = at_infinity(&scene->lights[scene->emitters[i].light]);
        s.far_count += far && weights[i] > 0.0;
        s.power += far ? 0.0 : weights[i];
    }
    for (int32_t i = 0; i < scene->light_count; i++)
        s.near_lights += !at_infinity(&scene->lights[i]) && emitters_of(scene, &scene->lights[i]) > 0;
    s.far = s.far_count ? 1.0 / (s.far_count + (s.power > 0.0 ? 1 : 0)) : 0.0;
    s.near = 1.0 - s.far * s.far_count;
    return s;
}

/* Power → probabilities; the finite lights share theirs by power. */
static void balance(const struct pt_scene *scene, const struct shares *s, double *weights)
{
    for (int32_t i = 0; i < scene->light_count; i++) {
        const struct pt_light *light = &scene->lights[i];
        int32_t count = emitters_of(scene, light);
        double *w = weights + light->first_emitter, sum = 0.0;
        for (int32_t k = 0; k < count; k++)
            sum += w[k];
        for (int32_t k = 0; k < count && sum > 0.0; k++)
            w[k] = at_infinity(light)
                       ? s->far
                       : s->near * (w[k] / s->power * (1.0 - UNIFORM_SHARE) + w[k] / sum * UNIFORM_SHARE / s->near_lights);
    }
}

void pt_alias_build(const double *weights, int32_t n, struct pt_emitter *emitters, int32_t *work)
{
    double sum = 0.0;
    for (int32_t i = 0; i < n; i++)
        sum += weights[i];
    /* `work` holds the small entries from the front and the large ones from the back */
    int32_t small = 0, large = n;
    for (int32_t i = 0; i < n; i++) {
        emitters[i].alias_q = (float)(weights[i] / sum * n);
        emitters[i].alias = i;
        if (emitters[i].alias_q < 1.0f)
            work[small++] = i;
        else
            work[--large] = i;
    }
    while (small > 0 && large < n) {
        int32_t s = work[--small], l = work[large];
        emitters[s].alias = l;
        emitters[l].alias_q -= 1.0f - emitters[s].alias_q;
        if (emitters[l].alias_q < 1.0f) {
            large++;
            work[small++] = l;
        }
    }
    while (large < n)
        emitters[work[large++]].alias_q = 1.0f;
    /* left over by rounding: but an entry of weight 0 must never be kept */
    while (small > 0) {
        int32_t s = work[--small];
        if (weights[s] > 0.0)
            emitters[s].alias_q = 1.0f;
    }
}

static int make_table(struct pt_scene *scene, double *weights, struct pt_arena *scratch)
{
    int32_t n = scene->emitter_count;
    int32_t *work = pt_arena_alloc(scratch, (size_t)n, sizeof *work);
    if (!work)
        return 0;
    double sum = 0.0;
    for (int32_t i = 0; i < n; i++)
        sum += weights[i];
    for (int32_t i = 0; i < n && !(sum > 0.0); i++)
        weights[i] = 1.0; /* only black lights */
    sum = sum > 0.0 ? sum : (double)n;
    pt_alias_build(weights, n, scene->emitters, work);
    for (int32_t i = 0; i < n; i++) {
        struct pt_emitter *e = &scene->emitters[i];
        e->pmf = (float)(weights[i] / sum);
        e->area_over_pmf = e->pmf > 0.0f ? e->area_over_pmf / e->pmf : 0.0f;
        if (e->primitive < 0)
            scene->lights[e->light].emitter_pmf = e->pmf;
    }
    return 1;
}

static void bound_quadric(const struct pt_shape *shape, const struct pt_quadric *q, struct pt_light_bounds *out)
{
    pt_quadric_bounds(q, &out->lower, &out->upper);
    if (q->kind != PT_QUADRIC_DISK)
        return;
    struct pt_quadric_point at;
    pt_quadric_at(q, v3(0.0f, 0.0f, q->z_min), &at);
    out->axis = v3_norm(shape->flip_normal ? v3_neg(at.n) : at.n);
    out->normals_rad = 0.0f;
}

/* Where the light of an emitter that is not at infinity comes from and where it goes; `power` as by power_of. 0: nowhere. */
static int bound_emitter(const struct pt_scene *scene, int32_t id, double power, struct pt_light_bounds *out)
{
    const struct pt_emitter *e = &scene->emitters[id];
    const struct pt_light *light = &scene->lights[e->light];
    const struct pt_shape *shape = light->kind == PT_LIGHT_AREA ? &scene->shapes[light->shape] : NULL;
    double pi = (double)PT_PI;
    *out = (struct pt_light_bounds){
        id, light->two_sided, light->position, light->position, {0.0f, 0.0f, 1.0f}, PT_PI, 0.5f * PT_PI, 0.0};
    if (e->primitive >= 0) {
        pt_vec3 b = v3_add(e->p0, e->e1), c = v3_add(e->p0, e->e2);
        out->lower = v3_least(e->p0, v3_least(b, c));
        out->upper = v3_most(e->p0, v3_most(b, c));
        out->axis = e->n;
        out->normals_rad = 0.0f;
        out->two_sided |= has_two_sides(e);
    } else if (shape) {
        bound_quadric(shape, &scene->quadrics[shape->data], out);
    } else if (light->kind == PT_LIGHT_SPOT) {
        out->axis = light->direction;
        /* light goes no further than a right angle off what counts as a normal */
        const float total_rad = (float)acos(light->cos_total);
        out->normals_rad = fmaxf((float)acos(light->cos_start), total_rad - 0.5f * PT_PI);
        out->emission_rad = total_rad - out->normals_rad + SPOT_SLACK;
    }
    /* power over all directions → what is sent one way */
    double solid = light->kind == PT_LIGHT_SPOT ? 2.0 * pi * (1.0 - 0.5 * (light->cos_total + light->cos_start))
                   : out->normals_rad < PT_PI   ? pi * (light->two_sided ? 2.0 : 1.0)
                                                : 4.0 * pi;
    out->intensity = power / solid;
    return out->intensity > 0.0 && isfinite(out->intensity) && v3_is_finite(out->lower) && v3_is_finite(out->upper) &&
           v3_is_finite(out->axis);
}

/* A share of the intensity spread evenly over the lights, as UNIFORM_SHARE is: strong lamps that stand in another room. */
static void spread(const struct pt_scene *scene, int32_t count, struct pt_light_bounds *bounds)
{
    const struct pt_emitter *emitters = scene->emitters;
    double total = 0.0;
    int lights = 0;
    for (int32_t i = 0; i < count; i++) {
        total += bounds[i].intensity;
        lights += i == 0 || emitters[bounds[i].emitter].light != emitters[bounds[i - 1].emitter].light;
    }
    for (int32_t i = 0, end; i < count; i = end) {
        double sum = 0.0;
        for (end = i; end < count && emitters[bounds[end].emitter].light == emitters[bounds[i].emitter].light; end++)
            sum += bounds[end].intensity;
        for (int32_t k = i; k < end; k++)
            bounds[k].intensity *= (1.0 - TREE_UNIFORM_SHARE) / total + TREE_UNIFORM_SHARE / (sum * lights);
    }
}

/* A place on a mesh that is no lamp, the k-th of PROBES; 0 when the shape has none. */
static int probe(const struct pt_scene *scene, int k, struct pt_rng *rng, struct pt_receiver *at)
{
    const struct pt_shape *shape = &scene->shapes[k % scene->world_shape_count];
    if (shape->kind != PT_SHAPE_MESH || shape->light >= 0)
        return 0;
    const struct pt_mesh *mesh = &scene->meshes[shape->data];
    uint32_t triangle = (uint32_t)(pt_rng_float(rng) * (float)mesh->triangle_count);
    const uint32_t *index = mesh->indices + 3 * (size_t)(triangle < mesh->triangle_count ? triangle : 0);
    float u = sqrtf(pt_rng_float(rng)), v = pt_rng_float(rng);
    pt_vec3 a = mesh->vertices[index[0]].p, e1 = v3_sub(mesh->vertices[index[1]].p, a),
            e2 = v3_sub(mesh->vertices[index[2]].p, a);
    pt_vec3 p = v3_madd(v3_madd(a, 1.0f - u, e1), u * v, e2);
    *at = (struct pt_receiver){p, v3_norm(v3_cross(e1, e2)), PT_RECEIVER_BOTH_SIDES};
    return 1;
}

/* How much more the second moment of the selection is by power than by the hierarchy, at places all over the scene: Σ p²/q
 * where what arrives is as the hierarchy's p says and q is by power. The median over places; visibility is not looked at. */
static double advantage(const struct pt_scene *scene)
{
    double ratios[PROBES], share = (double)scene->light_tree->share;
    int n = 0;
    struct pt_rng rng = pt_rng_make(1);
    struct pt_receiver at;
    for (int k = 0; k < PROBES && scene->world_shape_count > 0; k++) {
        if (!probe(scene, k, &rng, &at))
            continue;
        double sum = 0.0, all = 0.0;
        for (int32_t i = 0; i < scene->emitter_count; i++) {
            double p = (double)pt_light_tree_pmf(scene, &at, i) / share, q = (double)scene->emitters[i].pmf / share;
            all += p;
            sum += q > 0.0 ? p * p / q : 0.0;
        }
        if (all > 0.0)
            ratios[n++] = sum;
    }
    qsort(ratios, (size_t)n, sizeof *ratios, by_value);
    return n > 0 ? ratios[n / 2] : INFINITY;
}

/* Whether the hierarchy is wanted and there are enough emitters for it; then it is made. 0 when out of memory. */
static int make_tree(struct pt_scene *scene, const struct shares *s, const double *weights, struct pt_arena *scratch)
{
    size_t n = (size_t)scene->emitter_count;
    if (scene->light_selection != PT_LIGHT_SELECTION_HIERARCHY || s->near_lights < TREE_LIGHTS)
        return 1;
    struct pt_light_tree *tree = pt_arena_alloc(&scene->arena, 1, sizeof *tree);
    struct pt_light_bounds *bounds = pt_arena_alloc(scratch, n, sizeof *bounds);
    int32_t count = 0;
    if (!tree || !bounds)
        return 0;
    if (s->far_count > 0 && !(tree->far = pt_arena_alloc(&scene->arena, (size_t)s->far_count, sizeof *tree->far)))
        return 0;
    for (int32_t i = 0; i < scene->emitter_count; i++) {
        const int far = at_infinity(&scene->lights[scene->emitters[i].light]);
        if (far && weights[i] > 0.0)
            tree->far[tree->far_count++] = i;
        if (!far && bound_emitter(scene, i, weights[i], &bounds[count]))
            count++;
    }
    if (count < TREE_LIGHTS)
        return 1;
    spread(scene, count, bounds);
    float smallest = fmaxf(SMALLEST_NODE * v3_len(v3_sub(scene->bounds_max, scene->bounds_min)), 1e-18f);
    if (!pt_light_tree_build(tree, bounds, count, scene->emitter_count, smallest, &scene->arena, scratch))
        return 0;
    scene->light_tree = tree;
    return 1;
}

/* Lights at infinity keep the probability that the table gave them. */
static void finish_tree(struct pt_scene *scene)
{
    struct pt_light_tree *tree = scene->light_tree;
    double far = 0.0;
    for (int32_t i = 0; i < tree->far_count; i++)
        far += (double)scene->emitters[tree->far[i]].pmf;
    tree->share = (float)(1.0 - far);
    if (scene->emitter_count <= FEW && advantage(scene) < WORTH)
        scene->light_tree = NULL;
}

static int build_environments(struct pt_scene *scene)
{
    for (int32_t i = 0; i < scene->light_count; i++) {
        const struct pt_light *light = &scene->lights[i];
        if (light->kind == PT_LIGHT_ENV_CONSTANT || light->kind == PT_LIGHT_ENV_IMAGE)
            scene->env_lights[scene->env_light_count++] = i;
        if (light->kind == PT_LIGHT_ENV_IMAGE && !pt_light_env_build(scene, light, &scene->env_distributions[i]))
            return 0;
    }
    return 1;
}

int pt_lights_build(struct pt_scene *scene, struct base_err *err)
{
    int64_t count = 0;
    for (int32_t i = 0; i < scene->light_count; i++)
        count += emitters_of(scene, &scene->lights[i]);
    scene->emitter_count = 0;
    scene->env_light_count = 0;
    scene->light_tree = NULL;
    if (scene->light_count == 0)
        return 0;
    if (count > INT32_MAX / 2)
        return base_fail(err, BASE_EINVAL, "too many emitting triangles (%lld)", (long long)count);
    struct pt_arena scratch = {0};
    size_t lights = (size_t)scene->light_count;
    scene->env_lights = pt_arena_alloc(&scene->arena, lights, sizeof *scene->env_lights);
    scene->env_distributions = pt_arena_alloc(&scene->arena, lights, sizeof *scene->env_distributions);
    int ok = scene->env_lights && scene->env_distributions && build_environments(scene);
    if (ok && count > 0) {
        double *weights = pt_arena_alloc(&scratch, (size_t)count, sizeof *weights);
        scene->emitters = pt_arena_alloc(&scene->arena, (size_t)count, sizeof *scene->emitters);
        ok = weights && scene->emitters;
        if (ok) {
            scene->emitter_count = (int32_t)count;
            fill(scene, weights);
            /* in this order: the hierarchy takes powers, the table probabilities, and it judges a small hierarchy */
            const struct shares s = share_out(scene, weights);
            ok = make_tree(scene, &s, weights, &scratch);
            balance(scene, &s, weights);
            ok = ok && make_table(scene, weights, &scratch);
            if (ok && scene->light_tree)
                finish_tree(scene);
        }
    }
    pt_arena_release(&scratch);
    return ok ? 0 : base_fail_nomem(err, "the lights");
}
