/*
 * Texture evaluation. Constant inputs never come here: pt_input_* returns their value in place, and without PT_FX_TEXTURE in
 * the compile-time effect set the call itself does not exist.
 *
 * Pure functions on a read-only scene, thread-safe.
 */
#ifndef PT_SHADE_TEXTURE_H
#define PT_SHADE_TEXTURE_H

#include "scene/scene.h"

/* Number of texture evaluations of this thread so far: lets tests prove that untextured scenes make none. */
extern _Thread_local unsigned long long pt_texture_lookups;

/* Value of texture `number` at surface parameters (u, v). A float texture is the same in x, y, z. Finite for finite
 * images. */
pt_vec3 pt_texture_eval(const struct pt_scene *scene, int32_t number, float u, float v);

/* Step in u and v over which texture `number` is to be differenced: about one texel of the finest image in it. */
void pt_texture_step(const struct pt_scene *scene, int32_t number, float *step_u, float *step_v);

/* pt_texture.channel: what is read of an image's colours. Grey images have one value whatever it says. */
enum { PT_CHANNEL_LUMINANCE = -2, PT_CHANNEL_MEAN = -1, PT_CHANNEL_RGB = 0, PT_CHANNEL_ALPHA = 3 };

/* Texel (x, y), wrapped, linear (grey and float images: in x, y, z alike). */
pt_vec3 pt_image_texel(const struct pt_image_map *image, int32_t wrap, int32_t channel, int64_t x, int64_t y);
/* Bilinear; s to the right, t downwards, (0, 0) the upper left corner of the image, (1, 1) the lower right. */
pt_vec3 pt_image_bilinear(const struct pt_image_map *image, int32_t wrap, int32_t channel, float s, float t);

static inline pt_vec3 pt_input_rgb(pt_effects fx, const struct pt_scene *scene, const struct pt_input *in, float u, float v)
{
    if ((fx & PT_FX_TEXTURE) && in->texture)
        return pt_texture_eval(scene, in->texture, u, v);
    return in->value;
}

static inline float pt_input_float(pt_effects fx, const struct pt_scene *scene, const struct pt_input *in, float u, float v)
{
    return pt_input_rgb(fx, scene, in, u, v).x;
}

/* Fetches into the cache what texture `number` will read at (u, v), if it is an image. */
static inline void pt_texture_fetch(const struct pt_scene *scene, int32_t number, float u, float v)
{
    const struct pt_texture *t = &scene->textures[number - 1];
    if (t->kind != PT_TEXTURE_IMAGE)
        return;
    const struct pt_image_map *image = &scene->images[t->image];
    float x = t->su * u + t->du, y = 1.0f - (t->sv * v + t->dv);
    x = (x - floorf(x)) * (float)image->width - 0.5f; /* as if it repeated: else something else is fetched in vain */
    y = (y - floorf(y)) * (float)image->height - 0.5f;
    size_t size = image->type == PT_PIXEL_FLOAT ? 4 : 1, row = (size_t)image->width * (size_t)image->channels * size;
    if (!(x >= 0.0f && y >= 0.0f && y < (float)image->height - 1.0f))
        return;
    const char *texel = (const char *)image->pixels + (size_t)y * row + (size_t)x * (size_t)image->channels * size;
    __builtin_prefetch(texel);
    __builtin_prefetch(texel + row);
}

#endif
