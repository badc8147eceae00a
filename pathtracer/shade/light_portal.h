/*
 * Portals: parallelograms through which the light of an environment comes in, such as windows. They guide sampling only:
 * light that takes another way counts as well, it is only met less often.
 *
 * A point is chosen evenly on the parallelogram, so the density of a direction is distance² / (area · |cos|) where it passes
 * through, and 0 elsewhere.
 */
#ifndef PT_SHADE_LIGHT_PORTAL_H
#define PT_SHADE_LIGHT_PORTAL_H

#include <math.h>

#include "scene/scene.h"

/* Density per solid angle, at p, of a point x on the portal; w: unit, from p to x. INFINITY in the portal's own plane. */
static inline float pt_portal_density(const struct pt_light *light, pt_vec3 p, pt_vec3 x, pt_vec3 w)
{
    pt_vec3 d = v3_sub(x, p), n = v3_cross(light->portal_u, light->portal_v);
    return v3_dot(d, d) / fabsf(v3_dot(w, n)); /* |n| is the area */
}

/* Density with which pt_portal_sample chooses w (unit) at p. */
static inline float pt_portal_pdf(const struct pt_light *light, pt_vec3 p, pt_vec3 w)
{
    pt_vec3 n = v3_cross(light->portal_u, light->portal_v);
    float t = v3_dot(v3_sub(light->portal, p), n) / v3_dot(w, n);
    if (!(t > 0.0f && t < INFINITY))
        return 0.0f;
    pt_vec3 x = v3_madd(p, t, w), at = v3_sub(x, light->portal);
    float area2 = v3_dot(n, n), u = v3_dot(v3_cross(at, light->portal_v), n) / area2,
          v = v3_dot(v3_cross(light->portal_u, at), n) / area2;
    return u >= 0.0f && u <= 1.0f && v >= 0.0f && v <= 1.0f ? pt_portal_density(light, p, x, w) : 0.0f;
}

/* A direction from p through the portal, by numbers in [0, 1), and its density; 0 when there is none. */
static inline float pt_portal_sample(const struct pt_light *light, pt_vec3 p, float u0, float u1, pt_vec3 *w)
{
    pt_vec3 x = v3_madd(v3_madd(light->portal, u0, light->portal_u), u1, light->portal_v);
    *w = v3_norm(v3_sub(x, p));
    float pdf = pt_portal_density(light, p, x, *w);
    return pdf > 0.0f && pdf < INFINITY ? pdf : 0.0f;
}

#endif
