/* Lights of no size: point, spot (between the cones as in pbrt-v4 or v3), distant. */
#ifndef PT_SHADE_LIGHT_POINT_H
#define PT_SHADE_LIGHT_POINT_H

#include "shade/light.h"

static inline int pt_light_delta_sample(const struct pt_light *light, float pmf, pt_vec3 p_ref, struct pt_light_sample *out)
{
    out->delta = 1;
    out->inv_pdf_solid = 1.0f / pmf;
    out->radiance = light->emission;
    if (light->kind == PT_LIGHT_DISTANT) {
        out->finite = 0;
        out->wi = v3_neg(light->direction);
        return 1;
    }
    pt_vec3 d = v3_sub(light->position, p_ref);
    float dist2 = v3_dot(d, d);
    if (!(dist2 > 0.0f))
        return 0;
    out->finite = 1;
    out->target = light->position;
    out->wi = v3_scale(d, 1.0f / sqrtf(dist2));
    out->radiance = v3_scale(light->emission, 1.0f / dist2);
    if (light->kind == PT_LIGHT_SPOT) {
        /* 1 - cosine by the chord: of a narrow cone all of it would be lost to the rounding of the cosine */
        pt_vec3 chord = v3_add(out->wi, light->direction);
        double within = 1.0 - light->cos_total - 0.5 * (double)v3_dot(chord, chord);
        if (!(within > 0.0))
            return 0;
        float t = (float)fmin(1.0, within / (light->cos_start - light->cos_total));
        out->radiance = v3_scale(out->radiance, t * t * (light->is_quartic ? t * t : 3.0f - 2.0f * t));
    }
    return 1;
}

#endif
