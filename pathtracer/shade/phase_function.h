/*
 * Henyey–Greenstein phase function. Directions are unit; wo points back along the path, wi onwards, so that g > 0 (forward
 * scattering) prefers wi = -wo. The value is the density with which it is sampled.
 */
#ifndef PT_SHADE_PHASE_FUNCTION_H
#define PT_SHADE_PHASE_FUNCTION_H

#include "scene/vec.h"
#include "shade/warp.h"

/* Stronger asymmetry is beyond what float resolves. */
#define PT_PHASE_G_MAX 0.999f

static inline float pt_phase_clamp(float g) { return fminf(fmaxf(g, -PT_PHASE_G_MAX), PT_PHASE_G_MAX); }

/* p(wo → wi), 1/sr. Henyey and Greenstein 1941. */
static inline float pt_phase_eval(float g, pt_vec3 wo, pt_vec3 wi)
{
    g = pt_phase_clamp(g);
    float d = 1.0f + g * g + 2.0f * g * v3_dot(wo, wi), floor_d = (1.0f - fabsf(g)) * (1.0f - fabsf(g));
    d = fmaxf(d, floor_d); /* rounding of the dot product */
    return 0.25f * PT_INV_PI * (1.0f - g * g) / (d * sqrtf(d));
}

/* Draws wi and returns its density, which is also the phase function's value. */
static inline float pt_phase_sample(float g, pt_vec3 wo, float u0, float u1, pt_vec3 *wi)
{
    g = pt_phase_clamp(g);
    float cos_forward = 1.0f - 2.0f * u0; /* with -wo */
    if (fabsf(g) > 1e-3f) {
        float q = (1.0f - g * g) / (1.0f + g - 2.0f * g * u0);
        cos_forward = (1.0f + g * g - q * q) / (2.0f * g);
    }
    cos_forward = fminf(fmaxf(cos_forward, -1.0f), 1.0f);
    float r = sqrtf(fmaxf(0.0f, 1.0f - cos_forward * cos_forward)), s, c;
    pt_sincos_turn(u1, &s, &c);
    struct pt_frame frame = pt_frame_from_normal(v3_neg(wo));
    *wi = pt_frame_to_world(&frame, v3(r * c, r * s, cos_forward));
    return pt_phase_eval(g, wo, *wi);
}

#endif
