/*
 * Environment lights: radiance from infinity, constant or an image (latitude–longitude, or the equal-area octahedral map of
 * Clarberg 2008). Lookups are piecewise constant, so that density and radiance agree.
 */
#ifndef PT_SHADE_LIGHT_ENV_H
#define PT_SHADE_LIGHT_ENV_H

#include "shade/light.h"

/* Radiance from direction w (unit, render space; away from the scene). */
pt_vec3 pt_light_env_image_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w);
/* Density with which pt_light_env_sample chooses w at p, without the probability of the selection. */
float pt_light_env_density(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, pt_vec3 w);
/* A direction at p by numbers in [0, 1), its density, and the image's pixel; 0 when there is none. Half of the samples go
 * through the portal where there is one; all of them if the environment is constant, which is selected for that only. */
int pt_light_env_sample(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, float u0, float u1,
                        struct pt_light_sample *out);
/* The distribution from which the image is sampled, in the scene's arena; 0 when out of memory. */
int pt_light_env_build(struct pt_scene *scene, const struct pt_light *light, struct pt_env_distribution *out);
/* Mean luminance over the sphere. */
float pt_light_env_mean(const struct pt_scene *scene, const struct pt_light *light);

static inline pt_vec3 pt_light_env_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w)
{
    return light->kind == PT_LIGHT_ENV_CONSTANT ? light->emission : pt_light_env_image_eval(scene, light, w);
}

/* Density at p of w, which met the environment. */
static inline float pt_light_env_pdf(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 p, pt_vec3 w)
{
    if (light->kind == PT_LIGHT_ENV_CONSTANT && !light->has_portal)
        return 0.0f;
    return light->emitter_pmf * pt_light_env_density(scene, light, p, w);
}

#endif
