/*
 * Henyey–Greenstein phase function. Directions are unit; wo points back along the path, wi onwards, so that g > 0 (forward
 * scattering) prefers wi = -wo. The value is the density with which it is sampled.
 */
#ifndef PT_SHADE_PHASE_FUNCTION_H
#define PT_SHADE_PHASE_FUNCTION_H

#include "scene/vec.h"
#include "shade/warp.h"

/* The largest |g| of all functions here: what is left of 1 - |g| must be known to some digits in float. */
#define PT_PHASE_G_MAX 0.9999

/* p(wo → wi), 1/sr. Henyey and Greenstein 1941. Their 1 + g² - 2 g cos is written as (1 - |g|)² + |g| e², where e is the way
 * from wi to the direction that g prefers: both terms are positive, and nothing cancels around the peak. */
static inline float pt_phase_eval(float g, pt_vec3 wo, pt_vec3 wi)
{
    float a = fabsf(g), near = 1.0f - a;
    pt_vec3 e = v3_madd(wi, g < 0.0f ? -1.0f : 1.0f, wo);
    float d = near * near + a * v3_dot(e, e);
    return 0.25f * PT_INV_PI * near * (1.0f + a) / (d * sqrtf(d));
}

/* Draws wi and returns its density, which is also the phase function's value. `away` is 1 - cos from the direction that g
 * prefers: the inverse of the distribution function, solved for it so that nothing cancels. */
static inline float pt_phase_sample(float g, pt_vec3 wo, float u0, float u1, pt_vec3 *wi)
{
    float a = fabsf(g), near = 1.0f - a, side = g < 0.0f ? -1.0f : 1.0f;
    float u = g < 0.0f ? 1.0f - u0 : u0, d = near + 2.0f * a * (g < 0.0f ? u0 : 1.0f - u0);
    float away = fminf(2.0f * near * near * u * (near + a * (2.0f - u)) / (d * d), 2.0f);
    float r = sqrtf(away * (2.0f - away)), s, c;
    pt_sincos_turn(u1, &s, &c);
    struct pt_frame frame = pt_frame_from_normal(v3_neg(wo));
    *wi = pt_frame_to_world(&frame, v3(r * c, r * s, side * (1.0f - away)));
    return pt_phase_eval(g, wo, *wi);
}

#endif
