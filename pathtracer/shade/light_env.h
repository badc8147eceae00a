/*
 * Environment lights: radiance from infinity, constant or an image (latitude–longitude, or the equal-area octahedral map of
 * Clarberg 2008). Lookups are piecewise constant, so that density and radiance agree.
 */
#ifndef PT_SHADE_LIGHT_ENV_H
#define PT_SHADE_LIGHT_ENV_H

#include "shade/light.h"

/* Radiance from direction w (unit, render space; away from the scene). */
pt_vec3 pt_light_env_image_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w);
/* Density of sampling w, without the probability of the selection. */
float pt_light_env_image_pdf(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w);
int pt_light_env_image_sample(const struct pt_scene *scene, const struct pt_light *light, float u0, float u1,
                              struct pt_light_sample *out);
/* Alias table of the image. */
int pt_light_env_build(struct pt_scene *scene, const struct pt_light *light, struct pt_env_distribution *out);
/* Mean luminance over the sphere. */
float pt_light_env_mean(const struct pt_scene *scene, const struct pt_light *light);

static inline pt_vec3 pt_light_env_eval(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w)
{
    return light->kind == PT_LIGHT_ENV_CONSTANT ? light->emission : pt_light_env_image_eval(scene, light, w);
}

static inline float pt_light_env_pdf(const struct pt_scene *scene, const struct pt_light *light, pt_vec3 w)
{
    return light->kind == PT_LIGHT_ENV_CONSTANT ? 0.0f : light->emitter_pmf * pt_light_env_image_pdf(scene, light, w);
}

#endif
