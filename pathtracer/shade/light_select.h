/* Which light: the dispatchers over light kinds, and selection by power in constant time (an alias table) or by the
 * hierarchy. */
#ifndef PT_SHADE_LIGHT_SELECT_H
#define PT_SHADE_LIGHT_SELECT_H

#include "shade/light_area.h"
#include "shade/light_env.h"
#include "shade/light_point.h"

static inline const struct pt_emitter *pt_light_pick_by_power(const struct pt_scene *scene, float u_pick)
{
    float x = u_pick * (float)scene->emitter_count;
    int32_t i = (int32_t)x;
    if (i >= scene->emitter_count)
        i = scene->emitter_count - 1;
    const struct pt_emitter *e = &scene->emitters[i];
    return x - (float)i < e->alias_q ? e : &scene->emitters[e->alias];
}

/* Samples an emitter as if it had been selected by power. */
static inline int pt_light_sample_emitter(pt_effects fx, const struct pt_scene *scene, const struct pt_emitter *e,
                                          pt_vec3 p_ref, float u0, float u1, struct pt_light_sample *out)
{
    if (fx & PT_FX_ENVIRONMENT)
        out->pixel = NULL;
    if (fx & PT_FX_ALPHA)
        out->emitter = e;
    if (fx & (PT_FX_ENVIRONMENT | PT_FX_DELTA_LIGHT | PT_FX_QUADRIC)) {
        const struct pt_light *light = &scene->lights[e->light];
        if ((fx & PT_FX_QUADRIC) && light->kind == PT_LIGHT_AREA && e->primitive < 0)
            return pt_light_quadric_sample(scene, e, p_ref, u0, u1, out);
        if ((fx & PT_FX_ENVIRONMENT) && (light->kind == PT_LIGHT_ENV_IMAGE || light->kind == PT_LIGHT_ENV_CONSTANT)) {
            int lit = pt_light_env_sample(scene, light, p_ref, u0, u1, out);
            out->inv_pdf_solid /= e->pmf;
            return lit;
        }
        if ((fx & PT_FX_DELTA_LIGHT) && light->kind >= PT_LIGHT_DISTANT)
            return pt_light_delta_sample(light, e->pmf, p_ref, out);
    }
    return pt_light_triangle_sample(scene, e, p_ref, u0, u1, out);
}

/* Selects an emitter by u_pick and samples it towards `at`; numbers in [0, 1). 0 when nothing arrives from it. */
static inline int pt_light_sample(pt_effects fx, const struct pt_scene *scene, const struct pt_receiver *at, float u_pick,
                                  float u0, float u1, struct pt_light_sample *out)
{
    if (!scene->light_tree)
        return pt_light_sample_emitter(fx, scene, pt_light_pick_by_power(scene, u_pick), at->p, u0, u1, out);
    float pmf;
    int32_t i = pt_light_tree_pick(scene, at, u_pick, &pmf);
    if (i < 0 || !pt_light_sample_emitter(fx, scene, &scene->emitters[i], at->p, u0, u1, out))
        return 0;
    out->inv_pdf_solid *= scene->emitters[i].pmf / pmf;
    return 1;
}

#endif
