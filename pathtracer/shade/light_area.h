/* Area lights: triangles of meshes, and quadrics. The density is uniform over the area, but for whole spheres seen from
 * outside, where it is uniform over the cone they fill (Shirley, Wang & Zimmerman 1996). */
#ifndef PT_SHADE_LIGHT_AREA_H
#define PT_SHADE_LIGHT_AREA_H

#include "geom/offset.h"
#include "shade/light.h"

/* Area in render space, within 1e-4 of it. */
double pt_light_quadric_area(const struct pt_quadric *q);

/* Out of line: quadrics are rare as lights. A point on one, and the density of the way to it; 0 when that cannot be lit. */
int pt_light_quadric_sample(const struct pt_scene *scene, const struct pt_emitter *e, pt_vec3 p_ref, float u0, float u1,
                            struct pt_light_sample *out);
float pt_light_quadric_pdf(const struct pt_scene *scene, const struct pt_shape *shape, pt_vec3 p_ref, pt_vec3 p, pt_vec3 n,
                           pt_vec3 wi);

/* Light that a triangle sends to p_ref from the point that (u0, u1) choose, but for its radiance. Without branches: several
 * are worked out side by side (integ/lanes_body.h). 0: none. */
static inline int pt_light_triangle_towards(const struct pt_emitter *e, int two_sided, pt_vec3 p_ref, float u0, float u1,
                                            struct pt_light_sample *out)
{
    /* Uniform on the triangle: Heitz 2019, "A Low-Distortion Map Between Triangle and Square", without its branch */
    float half = 0.5f * (u0 < u1 ? u0 : u1), b1 = u0 - half, b2 = u1 - half;
    pt_vec3 p = v3_madd(v3_madd(e->p0, b1, e->e1), b2, e->e2), d = v3_sub(p, p_ref);
    float dist2 = v3_dot(d, d), towards = -v3_dot(e->n, d);
    towards = e->side.x + b1 * e->side.y + b2 * e->side.z < 0.0f ? -towards : towards;
    towards = two_sided ? fabsf(towards) : towards;
    float inv_dist = 1.0f / sqrtf(dist2);
    out->wi = v3_scale(d, inv_dist);
    /* dω = cos dA / dist², cos = towards / dist */
    out->inv_pdf_solid = e->area_over_pmf * towards * inv_dist * (inv_dist * inv_dist);
    /* of the point, and of the distance at which a ray from p_ref meets the surface */
    pt_vec3 size = v3_add(v3_add(v3_add(v3_abs(e->p0), v3_abs(e->e1)), v3_abs(e->e2)), v3_abs(d));
    out->target = pt_offset_point(p, e->n, v3_scale(size, PT_OFFSET_ERROR), v3_neg(d));
    return (towards > 0.0f) & (out->inv_pdf_solid > 0.0f);
}

/* Density with which sampling towards `at` would have chosen the point p (unit geometric normal n) of a shape's
 * primitive. */
static inline float pt_light_area_pdf(pt_effects fx, const struct pt_scene *scene, const struct pt_shape *shape,
                                      int32_t primitive, const struct pt_receiver *at, pt_vec3 p, pt_vec3 n, pt_vec3 wi)
{
    const struct pt_light *light = &scene->lights[shape->light];
    int quadric = (fx & PT_FX_QUADRIC) && shape->kind == PT_SHAPE_QUADRIC;
    int32_t emitter = light->first_emitter + (quadric ? 0 : primitive);
    const struct pt_emitter *e = &scene->emitters[emitter];
    float by_tree = scene->light_tree ? pt_light_tree_pmf(scene, at, emitter) / e->pmf : 1.0f;
    if (quadric)
        return by_tree * e->pmf * pt_light_quadric_pdf(scene, shape, at->p, p, n, wi);
    pt_vec3 d = v3_sub(p, at->p);
    float cosine = fabsf(v3_dot(e->n, wi));
    return cosine > 0.0f ? by_tree * v3_dot(d, d) / (e->area_over_pmf * cosine) : 0.0f;
}

#endif
