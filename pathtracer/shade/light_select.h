/* Which light: the dispatchers over light kinds, and selection in constant time by an alias table. */
#ifndef PT_SHADE_LIGHT_SELECT_H
#define PT_SHADE_LIGHT_SELECT_H

#include "shade/light_area.h"
#include "shade/light_env.h"
#include "shade/light_point.h"

/* Selects an emitter by u_pick and samples it towards p_ref; numbers in [0, 1). 0 when nothing arrives from it. */
static inline int pt_light_sample(pt_effects fx, const struct pt_scene *scene, pt_vec3 p_ref, float u_pick, float u0,
                                  float u1, struct pt_light_sample *out)
{
    float x = u_pick * (float)scene->emitter_count;
    int32_t i = (int32_t)x;
    if (i >= scene->emitter_count)
        i = scene->emitter_count - 1;
    const struct pt_emitter *e = &scene->emitters[i];
    if (!(x - (float)i < e->alias_q))
        e = &scene->emitters[e->alias];
    if (fx & PT_FX_ENVIRONMENT)
        out->pixel = NULL;
    if (fx & (PT_FX_ENVIRONMENT | PT_FX_DELTA_LIGHT | PT_FX_QUADRIC)) {
        const struct pt_light *light = &scene->lights[e->light];
        if ((fx & PT_FX_QUADRIC) && light->kind == PT_LIGHT_AREA && e->primitive < 0)
            return pt_light_quadric_sample(scene, e, p_ref, u0, u1, out);
        if ((fx & PT_FX_ENVIRONMENT) && light->kind == PT_LIGHT_ENV_IMAGE) {
            int lit = pt_light_env_image_sample(scene, light, u0, u1, out);
            out->inv_pdf_solid /= e->pmf;
            return lit;
        }
        if ((fx & PT_FX_DELTA_LIGHT) && light->kind >= PT_LIGHT_DISTANT)
            return pt_light_delta_sample(light, e->pmf, p_ref, out);
    }
    return pt_light_triangle_sample(scene, e, p_ref, u0, u1, out);
}

#endif
