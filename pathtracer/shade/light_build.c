#include "shade/light_build.h"

#include <math.h>

#include "shade/alias.h"
#include "shade/light_area.h"
#include "shade/light_env.h"

/* Share of the selection probability that is spread evenly over the finite lights, so that a weak lamp near the camera is
 * not starved by strong ones elsewhere. */
#define UNIFORM_SHARE 0.2

static int at_infinity(const struct pt_light *light)
{
    return light->kind == PT_LIGHT_ENV_IMAGE || light->kind == PT_LIGHT_DISTANT;
}

static int32_t emitters_of(const struct pt_scene *scene, const struct pt_light *light)
{
    if (light->kind == PT_LIGHT_ENV_CONSTANT)
        return 0;
    if (light->kind != PT_LIGHT_AREA || scene->shapes[light->shape].kind == PT_SHAPE_QUADRIC)
        return 1;
    return (int32_t)scene->meshes[scene->shapes[light->shape].data].triangle_count;
}

static pt_vec3 vertex(const float *data, uint32_t i) { return v3(data[3 * i], data[3 * i + 1], data[3 * i + 2]); }

/* Geometry of one triangle of a mesh light; returns its area. */
static double triangle_emitter(const struct pt_scene *scene, const struct pt_shape *shape, int32_t primitive,
                               struct pt_emitter *e)
{
    const struct pt_mesh *mesh = &scene->meshes[shape->data];
    const uint32_t *index = mesh->indices + 3 * (size_t)primitive;
    e->p0 = vertex(mesh->positions, index[0]);
    e->e1 = v3_sub(vertex(mesh->positions, index[1]), e->p0);
    e->e2 = v3_sub(vertex(mesh->positions, index[2]), e->p0);
    pt_vec3 n = v3_cross(e->e1, e->e2);
    double area = 0.5 * sqrt((double)n.x * (double)n.x + (double)n.y * (double)n.y + (double)n.z * (double)n.z);
    e->n = area > 0.0 ? v3_scale(n, (float)(0.5 / area)) : v3_splat(0.0f);
    e->area_over_pmf = (float)area; /* divided by the pmf once that is known */
    int against = shape->flip_normal;
    if (mesh->normals) {
        pt_vec3 ns = v3_add(vertex(mesh->normals, index[0]), v3_add(vertex(mesh->normals, index[1]),
                                                                    vertex(mesh->normals, index[2])));
        against = v3_dot(ns, n) < 0.0f;
    }
    if (against)
        e->n = v3_neg(e->n);
    return isfinite(e->area_over_pmf) ? area : 0.0;
}

/* Radiant power up to a common factor (luminance). */
static double power_of(const struct pt_scene *scene, const struct pt_light *light, double area)
{
    double pi = 3.14159265358979323846, l = (double)v3_luminance(light->emission);
    /* a bad value must still be selected, so that it is met and counted */
    l = !isfinite(l) ? 1.0 : l > 0.0 ? l : 0.0;
    pt_vec3 d = v3_sub(scene->bounds_max, scene->bounds_min);
    double disk = pi * 0.25 * (double)v3_dot(d, d);
    switch (light->kind) {
    case PT_LIGHT_AREA:
        return pi * area * l * (light->two_sided ? 2.0 : 1.0);
    case PT_LIGHT_ENV_IMAGE:
        return 4.0 * pi * disk * (double)pt_light_env_mean(scene, light);
    case PT_LIGHT_DISTANT:
        return disk * l;
    case PT_LIGHT_SPOT:
        return 2.0 * pi * l * (1.0 - 0.5 * (double)(light->cos_total + light->cos_start));
    case PT_LIGHT_POINT:
        return 4.0 * pi * l;
    default:
        return 0.0;
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
                area = (double)pt_light_quadric_area(&scene->quadrics[shape->data]);
            weights[n] = power_of(scene, light, area);
        }
    }
}

/* Power → probabilities: every light at infinity gets 1/(1 + number of them) when there are finite ones too (their power
 * depends on the scene's size, not on what they do to the image), the finite ones share the rest by power. */
static void balance(const struct pt_scene *scene, double *weights)
{
    double finite = 0.0;
    int infinite_count = 0, finite_count = 0;
    for (int32_t i = 0; i < scene->emitter_count; i++) {
        int far = at_infinity(&scene->lights[scene->emitters[i].light]);
        infinite_count += far && weights[i] > 0.0;
        finite += far ? 0.0 : weights[i];
    }
    for (int32_t i = 0; i < scene->light_count; i++)
        finite_count += !at_infinity(&scene->lights[i]) && emitters_of(scene, &scene->lights[i]) > 0;
    double far_share = infinite_count ? 1.0 / (infinite_count + (finite > 0.0 ? 1 : 0)) : 0.0;
    double near_share = 1.0 - far_share * infinite_count;
    for (int32_t i = 0; i < scene->light_count; i++) {
        const struct pt_light *light = &scene->lights[i];
        int32_t count = emitters_of(scene, light);
        double *w = weights + light->first_emitter, sum = 0.0;
        for (int32_t k = 0; k < count; k++)
            sum += w[k];
        for (int32_t k = 0; k < count && sum > 0.0; k++)
            w[k] = at_infinity(light) ? far_share
                                      : near_share * (w[k] / finite * (1.0 - UNIFORM_SHARE) +
                                                      w[k] / sum * UNIFORM_SHARE / finite_count);
    }
}

static int make_table(struct pt_scene *scene, double *weights, struct pt_arena *scratch)
{
    int32_t n = scene->emitter_count;
    float *q = pt_arena_alloc(scratch, (size_t)n, sizeof *q);
    int32_t *alias = pt_arena_alloc(scratch, (size_t)n, sizeof *alias),
        *work = pt_arena_alloc(scratch, (size_t)n, sizeof *work);
    if (!q || !alias || !work)
        return 0;
    double sum = 0.0;
    for (int32_t i = 0; i < n; i++)
        sum += weights[i];
    for (int32_t i = 0; i < n && !(sum > 0.0); i++)
        weights[i] = 1.0; /* only black lights */
    sum = sum > 0.0 ? sum : (double)n;
    pt_alias_build(weights, n, q, alias, work);
    for (int32_t i = 0; i < n; i++) {
        struct pt_emitter *e = &scene->emitters[i];
        e->alias = alias[i];
        e->alias_q = q[i];
        e->pmf = (float)(weights[i] / sum);
        e->area_over_pmf = e->pmf > 0.0f ? e->area_over_pmf / e->pmf : 0.0f;
        if (e->primitive < 0)
            scene->lights[e->light].emitter_pmf = e->pmf;
    }
    return 1;
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
    if (scene->light_count == 0)
        return 0;
    if (count > INT32_MAX / 2)
        return base_fail(err, BASE_EINVAL, "too many emitting triangles (%lld)", (long long)count);
    struct pt_arena scratch = {0};
    int ok = 1;
    size_t lights = (size_t)scene->light_count;
    scene->env_lights = pt_arena_alloc(&scene->arena, lights, sizeof *scene->env_lights);
    scene->env_distributions = pt_arena_alloc(&scene->arena, lights, sizeof *scene->env_distributions);
    ok = scene->env_lights && scene->env_distributions && build_environments(scene);
    if (ok && count > 0) {
        double *weights = pt_arena_alloc(&scratch, (size_t)count, sizeof *weights);
        scene->emitters = pt_arena_alloc(&scene->arena, (size_t)count, sizeof *scene->emitters);
        ok = weights && scene->emitters;
        if (ok) {
            scene->emitter_count = (int32_t)count;
            fill(scene, weights);
            balance(scene, weights);
            ok = make_table(scene, weights, &scratch);
        }
    }
    pt_arena_release(&scratch);
    return ok ? 0 : base_fail_nomem(err, "the lights");
}
