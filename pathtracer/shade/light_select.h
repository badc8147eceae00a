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
    const struct pt_light *light = &scene->lights[e->light];
    out->radiance = light->emission;
    out->delta = 0;
    out->finite = 1;
    if (fx & PT_FX_ENVIRONMENT)
        out->pixel = NULL;
    if (fx & (PT_FX_ALPHA | PT_FX_CONTACT))
        out->emitter = e;
    if ((fx & PT_FX_QUADRIC) && light->kind == PT_LIGHT_AREA && e->primitive < 0)
        return pt_light_quadric_sample(scene, e, p_ref, u0, u1, out);
    if ((fx & PT_FX_ENVIRONMENT) && (light->kind == PT_LIGHT_ENV_IMAGE || light->kind == PT_LIGHT_ENV_CONSTANT)) {
        out->finite = 0;
        int lit = pt_light_env_sample(scene, light, p_ref, u0, u1, out);
        out->inv_pdf_solid /= e->pmf;
        return lit;
    }
    if ((fx & PT_FX_DELTA_LIGHT) && light->kind >= PT_LIGHT_DISTANT)
        return pt_light_delta_sample(light, e->pmf, p_ref, out);
    return pt_light_triangle_towards(e, light->two_sided, p_ref, u0, u1, out);
}

/* The emitter that u in [0, 1) selects at a place, NULL: none; *by_tree: the probability of its selection by power over that
 * with which it was selected. */
static inline const struct pt_emitter *pt_light_pick(const struct pt_scene *scene, const struct pt_receiver *at, float u,
                                                     float *by_tree)
{
    *by_tree = 1.0f;
    if (!scene->light_tree)
        return pt_light_pick_by_power(scene, u);
    float pmf;
    int32_t i = pt_light_tree_pick(scene, at, u, &pmf);
    if (i < 0)
        return NULL;
    *by_tree = scene->emitters[i].pmf / pmf;
    return &scene->emitters[i];
}

/* Selects an emitter by u_pick and samples it towards `at`; numbers in [0, 1). 0 when nothing arrives from it. */
static inline int pt_light_sample(pt_effects fx, const struct pt_scene *scene, const struct pt_receiver *at, float u_pick,
                                  float u0, float u1, struct pt_light_sample *out)
{
    float by_tree;
    const struct pt_emitter *e = pt_light_pick(scene, at, u_pick, &by_tree);
    if (!e || !pt_light_sample_emitter(fx, scene, e, at->p, u0, u1, out))
        return 0;
    out->inv_pdf_solid *= by_tree;
    return 1;
}

#endif
