#include "shade/light_area.h"

#include <math.h>

#include "geom/quadric.h"

/* The factor by which a similarity scales lengths; 0 when the transform is none. */
static float similarity(const struct pt_mat34 *t)
{
    const float *m = t->m;
    pt_vec3 x = v3(m[0], m[4], m[8]), y = v3(m[1], m[5], m[9]), z = v3(m[2], m[6], m[10]);
    float xx = v3_dot(x, x), tolerance = 1e-4f * xx;
    int similar = fabsf(v3_dot(y, y) - xx) < tolerance && fabsf(v3_dot(z, z) - xx) < tolerance &&
                  fabsf(v3_dot(x, y)) < tolerance && fabsf(v3_dot(x, z)) < tolerance && fabsf(v3_dot(y, z)) < tolerance;
    return similar ? sqrtf(xx) : 0.0f;
}

/* Steps in which the area of a stretched quadric is summed up: within 1e-4 however flat or long the transform makes it. */
enum { AREA_STEPS = 256 };

/* A point of the sphere itself counts as inside: its own rounding must not decide which way it is lit, and from outside only
 * the near half is sampled, which for an inner side is the point itself. */
#define ON_SPHERE 0.99999f

/* 1 - cos of the half angle of the cone that a whole sphere under a similarity fills as seen from p_ref, with its centre and
 * radius in render space. 0 for other quadrics, from inside, and where a mask lets rays through, so that the far side is
 * seen, too. */
static float cone_of(const struct pt_quadric *q, const struct pt_shape *shape, pt_vec3 p_ref, pt_vec3 *centre, float *radius)
{
    const float *m = q->to_render.m;
    if (q->kind != PT_QUADRIC_SPHERE || q->z_min > -q->radius || q->z_max < q->radius || q->phi_max < 2.0f * PT_PI - 1e-4f ||
        (shape->has_alpha && (shape->alpha.texture || shape->alpha.value.x > 0.0f)))
        return 0.0f;
    *centre = v3(m[3], m[7], m[11]);
    *radius = q->radius * similarity(&q->to_render);
    pt_vec3 to_centre = v3_sub(*centre, p_ref);
    float dist2 = v3_dot(to_centre, to_centre), sin2 = *radius * *radius / dist2;
    /* without cancellation: 1 - cos θ = sin² θ / (1 + cos θ) */
    return *radius > 0.0f && sin2 < ON_SPHERE ? sin2 / (1.0f + sqrtf(1.0f - sin2)) : 0.0f;
}

/* Area in the quadric's own space. */
static float area_of(const struct pt_quadric *q)
{
    if (q->kind == PT_QUADRIC_DISK)
        return 0.5f * q->phi_max * (q->radius * q->radius - q->inner_radius * q->inner_radius);
    /* Archimedes: the zone of a sphere has the area of the cylinder around it */
    return q->phi_max * q->radius * (q->z_max - q->z_min);
}

/* dA in render space per dA in the quadric's space, where its unit normal there is n: |det M| |M⁻ᵀ n|. */
static float area_scale(const struct pt_quadric *q, pt_vec3 n)
{
    const float *m = q->to_render.m;
    float det =
        m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
    return fabsf(det) * v3_len(pt_mat34_normal(&q->from_render, n));
}

static pt_vec3 point_on(const struct pt_quadric *q, float u0, float u1, pt_vec3 *n)
{
    float phi = u0 * q->phi_max, c = cosf(phi), s = sinf(phi);
    if (q->kind == PT_QUADRIC_DISK) {
        float r2 = q->inner_radius * q->inner_radius, r = sqrtf(r2 + u1 * (q->radius * q->radius - r2));
        *n = v3(0.0f, 0.0f, 1.0f);
        return v3(r * c, r * s, q->z_min);
    }
    float z = q->z_min + u1 * (q->z_max - q->z_min);
    if (q->kind == PT_QUADRIC_CYLINDER) {
        *n = v3(c, s, 0.0f);
        return v3(q->radius * c, q->radius * s, z);
    }
    float rho = sqrtf(fmaxf(0.0f, q->radius * q->radius - z * z));
    *n = v3(rho * c / q->radius, rho * s / q->radius, z / q->radius);
    return v3(rho * c, rho * s, z);
}

/* Mean of the area scale over a sphere or a cylinder, or what is left of it, weighted by area: the midpoint rule over φ and,
 * as the integrand is smooth in it, the polar angle θ. */
static double mean_area_scale(const struct pt_quadric *q)
{
    float sin_theta[AREA_STEPS] = {1.0f}, cos_theta[AREA_STEPS] = {0.0f};
    int n = q->kind == PT_QUADRIC_SPHERE ? AREA_STEPS : 1;
    for (int k = 0; k < n && n > 1; k++) {
        float top = acosf(q->z_max / q->radius),
              theta = top + (acosf(q->z_min / q->radius) - top) * ((float)k + 0.5f) / AREA_STEPS;
        sin_theta[k] = sinf(theta);
        cos_theta[k] = cosf(theta);
    }
    double sum = 0.0, weights = 0.0;
    for (int i = 0; i < AREA_STEPS; i++) {
        float phi = q->phi_max * ((float)i + 0.5f) / AREA_STEPS, c = cosf(phi), s = sinf(phi);
        for (int k = 0; k < n; k++) {
            sum += (double)(sin_theta[k] * area_scale(q, v3(sin_theta[k] * c, sin_theta[k] * s, cos_theta[k])));
            weights += (double)sin_theta[k];
        }
    }
    return sum / weights;
}

double pt_light_quadric_area(const struct pt_quadric *q)
{
    double own = (double)area_of(q), scale = (double)similarity(&q->to_render);
    if (q->kind == PT_QUADRIC_DISK)
        return own * (double)area_scale(q, v3(0.0f, 0.0f, 1.0f));
    return own * (scale > 0.0 ? scale * scale : mean_area_scale(q));
}

static int finish(const struct pt_light *light, const struct pt_shape *shape, pt_vec3 p_ref, pt_vec3 p, pt_vec3 n_out,
                  pt_vec3 error, struct pt_light_sample *out)
{
    pt_vec3 d = v3_sub(p, p_ref), n = shape->flip_normal ? v3_neg(n_out) : n_out;
    if (!(v3_dot(n, d) < 0.0f) && !light->two_sided)
        return 0;
    /* as of triangles (light_area.h) */
    error = v3_add(error, v3_scale(v3_abs(d), PT_OFFSET_ERROR));
    out->target = pt_offset_point(p, n, error, v3_neg(d));
    return out->inv_pdf_solid > 0.0f && out->inv_pdf_solid < INFINITY;
}

static int sample_cone(const struct pt_light *light, const struct pt_shape *shape, pt_vec3 p_ref, pt_vec3 centre,
                       float radius, float one_minus_cos, float u0, float u1, struct pt_light_sample *out)
{
    pt_vec3 to_centre = v3_sub(centre, p_ref);
    float dist = v3_len(to_centre), h = u0 * one_minus_cos, cos_theta = 1.0f - h, sin2 = h * (2.0f - h),
          phi = 2.0f * PT_PI * u1;
    float sin_theta = sqrtf(sin2), cos_phi = cosf(phi), sin_phi = sinf(phi);
    struct pt_frame frame = pt_frame_from_normal(v3_scale(to_centre, 1.0f / dist));
    out->wi = pt_frame_to_world(&frame, v3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta));
    /* wi meets the surface at β to its normal, sin β = sin θ dist / radius, which is α = β - θ off the way back from the
     * centre. From that and not from the point that wi meets, in which a far and small sphere would be lost. */
    float sin_beta = fminf(1.0f, sin_theta * dist / radius), cos_beta = sqrtf(1.0f - sin_beta * sin_beta);
    float sin_alpha = sin_beta * cos_theta - cos_beta * sin_theta, cos_alpha = cos_beta * cos_theta + sin_beta * sin_theta;
    pt_vec3 n = pt_frame_to_world(&frame, v3(sin_alpha * cos_phi, sin_alpha * sin_phi, -cos_alpha)),
            p = v3_madd(centre, radius, n);
    pt_vec3 error = v3_scale(v3_add(v3_abs(centre), v3_splat(radius)), PT_OFFSET_ERROR);
    out->inv_pdf_solid = 2.0f * PT_PI * one_minus_cos;
    return finish(light, shape, p_ref, p, n, error, out);
}

int pt_light_quadric_sample(const struct pt_scene *scene, const struct pt_emitter *e, pt_vec3 p_ref, float u0, float u1,
                            struct pt_light_sample *out)
{
    const struct pt_light *light = &scene->lights[e->light];
    const struct pt_shape *shape = &scene->shapes[light->shape];
    const struct pt_quadric *q = &scene->quadrics[shape->data];
    pt_vec3 centre, n_quadric;
    float radius, one_minus_cos = cone_of(q, shape, p_ref, &centre, &radius);
    if (one_minus_cos > 0.0f) {
        int lit = sample_cone(light, shape, p_ref, centre, radius, one_minus_cos, u0, u1, out);
        out->inv_pdf_solid /= e->pmf;
        return lit;
    }
    struct pt_quadric_point at;
    pt_vec3 p_quadric = point_on(q, u0, u1, &n_quadric);
    pt_quadric_at(q, p_quadric, &at);
    pt_vec3 n = v3_norm(at.n), d = v3_sub(at.p, p_ref);
    float dist2 = v3_dot(d, d), dist = sqrtf(dist2), cosine = fabsf(v3_dot(n, d)) / dist;
    if (!(cosine > 0.0f))
        return 0;
    out->wi = v3_scale(d, 1.0f / dist);
    out->inv_pdf_solid = cosine * area_of(q) * area_scale(q, n_quadric) / (e->pmf * dist2);
    return finish(light, shape, p_ref, at.p, n, at.error, out);
}

float pt_light_quadric_pdf(const struct pt_scene *scene, const struct pt_shape *shape, pt_vec3 p_ref, pt_vec3 p, pt_vec3 n,
                           pt_vec3 wi)
{
    const struct pt_quadric *q = &scene->quadrics[shape->data];
    pt_vec3 centre;
    float radius, one_minus_cos = cone_of(q, shape, p_ref, &centre, &radius);
    if (one_minus_cos > 0.0f)
        return 1.0f / (2.0f * PT_PI * one_minus_cos);
    pt_vec3 d = v3_sub(p, p_ref), n_quadric = v3_norm(pt_mat34_normal(&q->to_render, n)); /* ∝ Mᵀ n */
    float cosine = fabsf(v3_dot(n, wi));
    return cosine > 0.0f ? v3_dot(d, d) / (cosine * area_of(q) * area_scale(q, n_quadric)) : 0.0f;
}
