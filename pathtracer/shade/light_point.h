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
        float c = -v3_dot(out->wi, light->direction);
        float t = fminf(1.0f, fmaxf(0.0f, (c - light->cos_total) / (light->cos_start - light->cos_total)));
        if (!(c > light->cos_total))
            return 0;
        out->radiance = v3_scale(out->radiance, t * t * (light->is_quartic ? t * t : 3.0f - 2.0f * t));
    }
    return 1;
}

#endif
