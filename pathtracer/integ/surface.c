#include "integ/surface.h"

/* Cofactors of the linear part: transforms normals like the inverse transpose, up to a positive factor when det > 0. */
static pt_vec3 transform_normal(const struct pt_mat34 *t, pt_vec3 n)
{
    const float *m = t->m;
    pt_vec3 r0 = v3(m[0], m[1], m[2]), r1 = v3(m[4], m[5], m[6]), r2 = v3(m[8], m[9], m[10]);
    pt_vec3 c0 = v3_cross(r1, r2), c1 = v3_cross(r2, r0), c2 = v3_cross(r0, r1);
    float sign = v3_dot(r0, c0) < 0.0f ? -1.0f : 1.0f;
    return v3_unit(v3_scale(v3(v3_dot(c0, n), v3_dot(c1, n), v3_dot(c2, n)), sign));
}

void pt_place_instance(const struct pt_scene *scene, int32_t instance, float time, struct pt_place *at)
{
    struct pt_mat34 t;
    pt_accel_instance_transform(scene, instance, time, &t);
    const float *m = t.m;
    pt_vec3 p = at->p, e = at->error;
    at->p = pt_mat34_point(&t, p);
    /* error of the point carried through, and rounding of the transform itself and of the ray's trip into object space */
    float error[3];
    for (int i = 0; i < 3; i++) {
        float x = fabsf(m[4 * i]), y = fabsf(m[4 * i + 1]), z = fabsf(m[4 * i + 2]);
        error[i] = x * e.x + y * e.y + z * e.z +
                   PT_OFFSET_ERROR * (x * fabsf(p.x) + y * fabsf(p.y) + z * fabsf(p.z) + fabsf(m[4 * i + 3]));
    }
    at->error = v3(error[0], error[1], error[2]);
    at->s.n_geometric = transform_normal(&t, at->s.n_geometric);
    at->s.n_shading = transform_normal(&t, at->s.n_shading);
    at->s.dpdu = pt_mat34_vector(&t, at->s.dpdu);
    at->s.dpdv = pt_mat34_vector(&t, at->s.dpdv);
}

float pt_place_lamp_alpha(const struct pt_scene *scene, struct pt_light_sample *light)
{
    const struct pt_emitter *e = light->emitter;
    const struct pt_light *lamp = &scene->lights[e->light];
    const struct pt_shape *shape = lamp->kind == PT_LIGHT_AREA ? &scene->shapes[lamp->shape] : NULL;
    if (!shape || !shape->has_alpha)
        return 1.0f;
    if (!shape->alpha.texture) {
        light->delta = shape->alpha.value.x <= 0.0f;
        return light->delta ? 1.0f : shape->alpha.value.x;
    }
    struct pt_place at = {.shape = shape};
    struct pt_hit hit = {.shape = lamp->shape, .instance = -1, .primitive = e->primitive, .geometric = e->n};
    if (shape->kind == PT_SHAPE_QUADRIC) {
        hit.geometric = pt_mat34_point(&scene->quadrics[shape->data].from_render, light->target);
        pt_place_quadric(scene, &hit, &at);
    } else {
        pt_vec3 d = v3_sub(light->target, e->p0), n = v3_cross(e->e1, e->e2);
        float inv = 1.0f / v3_dot(n, n);
        hit.u = v3_dot(v3_cross(d, e->e2), n) * inv;
        hit.v = v3_dot(v3_cross(e->e1, d), n) * inv;
        pt_place_mesh(PT_FX_ALPHA, scene, &hit, &at);
    }
    return fminf(1.0f, fmaxf(0.0f, pt_shape_alpha(scene, shape, at.s.u, at.s.v)));
}
