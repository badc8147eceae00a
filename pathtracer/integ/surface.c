#include "integ/surface.h"

/* Cofactors of the linear part: transforms normals like the inverse transpose, up to a positive factor when det > 0. */
static pt_vec3 transform_normal(const struct pt_mat34 *t, pt_vec3 n)
{
    const float *m = t->m;
    pt_vec3 r0 = v3(m[0], m[1], m[2]), r1 = v3(m[4], m[5], m[6]), r2 = v3(m[8], m[9], m[10]);
    pt_vec3 c0 = v3_cross(r1, r2), c1 = v3_cross(r2, r0), c2 = v3_cross(r0, r1);
    float sign = v3_dot(r0, c0) < 0.0f ? -1.0f : 1.0f;
    return v3_norm(v3_scale(v3(v3_dot(c0, n), v3_dot(c1, n), v3_dot(c2, n)), sign));
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
