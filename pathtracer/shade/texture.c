#include "shade/texture.h"

#include "base/colour.h"

_Thread_local unsigned long long pt_texture_lookups;

/* Index in [0, n) or -1 for black. */
static int64_t wrap_index(int32_t wrap, int64_t i, int64_t n)
{
    if (i >= 0 && i < n)
        return i;
    if (wrap == PT_WRAP_BLACK)
        return -1;
    if (wrap == PT_WRAP_CLAMP)
        return i < 0 ? 0 : n - 1;
    int64_t m = i % n;
    return m < 0 ? m + n : m;
}

static float decode(const struct pt_image_map *image, size_t index)
{
    if (image->type == PT_PIXEL_FLOAT)
        return ((const float *)image->pixels)[index];
    uint8_t byte = ((const uint8_t *)image->pixels)[index];
    if (image->type == PT_PIXEL_U8_SRGB)
        return base_srgb_linear_f32[byte];
    float value = (float)byte * (1.0f / 255.0f);
    return image->gamma == 1.0f ? value : powf(value, image->gamma);
}

/* Colour of the texel whose first channel is value i; linear RGB. */
static inline pt_vec3 colour_at(const struct pt_image_map *image, size_t i)
{
    if (image->channels < 3)
        return v3_splat(decode(image, i));
    if (image->type == PT_PIXEL_U8_SRGB) {
        const uint8_t *p = (const uint8_t *)image->pixels + i;
        return v3(base_srgb_linear_f32[p[0]], base_srgb_linear_f32[p[1]], base_srgb_linear_f32[p[2]]);
    }
    return v3(decode(image, i), decode(image, i + 1), decode(image, i + 2));
}

pt_vec3 pt_image_texel(const struct pt_image_map *image, int32_t wrap, int32_t channel, int64_t x, int64_t y)
{
    x = wrap_index(wrap, x, image->width);
    y = wrap_index(wrap, y, image->height);
    if (x < 0 || y < 0)
        return v3_splat(0.0f);
    size_t i = ((size_t)y * (size_t)image->width + (size_t)x) * (size_t)image->channels;
    if (channel == PT_CHANNEL_ALPHA) { /* alpha is stored linearly whatever the colours are */
        if (image->channels < 4)
            return v3_splat(1.0f);
        if (image->type == PT_PIXEL_FLOAT)
            return v3_splat(((const float *)image->pixels)[i + 3]);
        return v3_splat((float)((const uint8_t *)image->pixels)[i + 3] * (1.0f / 255.0f));
    }
    pt_vec3 colour = colour_at(image, i);
    if (channel == PT_CHANNEL_RGB || image->channels < 3)
        return colour;
    return v3_splat(channel == PT_CHANNEL_MEAN ? v3_mean(colour) : v3_luminance(colour));
}

static inline pt_vec3 blend4(pt_vec3 a, pt_vec3 b, pt_vec3 c, pt_vec3 d, float dx, float dy)
{
    pt_vec3 top = v3_madd(v3_scale(a, 1.0f - dx), dx, b), bottom = v3_madd(v3_scale(c, 1.0f - dx), dx, d);
    return v3_madd(v3_scale(top, 1.0f - dy), dy, bottom);
}

/* Beyond this, texel indices have no meaning left in float; also catches NaN. */
static const float limit = 1e9f;

static pt_vec3 nearest(const struct pt_image_map *image, int32_t wrap, int32_t channel, float s, float t)
{
    float x = floorf(s * (float)image->width), y = floorf(t * (float)image->height);
    if (!(fabsf(x) < limit && fabsf(y) < limit))
        x = y = 0.0f;
    return pt_image_texel(image, wrap, channel, (int64_t)x, (int64_t)y);
}

pt_vec3 pt_image_bilinear(const struct pt_image_map *image, int32_t wrap, int32_t channel, float s, float t)
{
    float fx = s * (float)image->width - 0.5f, fy = t * (float)image->height - 0.5f;
    if (!(fabsf(fx) < limit && fabsf(fy) < limit))
        fx = fy = 0.0f;
    float x0 = floorf(fx), y0 = floorf(fy), dx = fx - x0, dy = fy - y0;
    int64_t x = (int64_t)x0, y = (int64_t)y0;
    if (channel == PT_CHANNEL_RGB && wrap != PT_WRAP_BLACK) { /* nearly all lookups: each index is wrapped once */
        int64_t xa = wrap_index(wrap, x, image->width), xb = wrap_index(wrap, x + 1, image->width);
        int64_t row_a = wrap_index(wrap, y, image->height) * image->width;
        int64_t row_b = wrap_index(wrap, y + 1, image->height) * image->width;
        size_t n = (size_t)image->channels;
        return blend4(colour_at(image, (size_t)(row_a + xa) * n), colour_at(image, (size_t)(row_a + xb) * n),
                      colour_at(image, (size_t)(row_b + xa) * n), colour_at(image, (size_t)(row_b + xb) * n), dx, dy);
    }
    return blend4(pt_image_texel(image, wrap, channel, x, y), pt_image_texel(image, wrap, channel, x + 1, y),
                  pt_image_texel(image, wrap, channel, x, y + 1), pt_image_texel(image, wrap, channel, x + 1, y + 1), dx,
                  dy);
}

static pt_vec3 eval_image(const struct pt_scene *scene, const struct pt_texture *t, float s, float v)
{
    /* Image rows run downwards, texture coordinates upwards. */
    const struct pt_image_map *image = &scene->images[t->image];
    pt_vec3 texels = t->is_nearest ? nearest(image, t->wrap, t->channel, s, 1.0f - v)
                                   : pt_image_bilinear(image, t->wrap, t->channel, s, 1.0f - v);
    pt_vec3 value = v3_scale(texels, t->scale);
    if (t->invert)
        value = v3_sub(v3_splat(1.0f), value);
    return t->is_signed ? value : v3_most(value, v3_splat(0.0f));
}

/* Recursion ends: inputs of a texture have smaller numbers. The loader bounds the depth. */
static pt_vec3 eval_input(const struct pt_scene *scene, const struct pt_input *in, float u, float v)
{
    return in->texture ? pt_texture_eval(scene, in->texture, u, v) : in->value;
}

pt_vec3 pt_texture_eval(const struct pt_scene *scene, int32_t number, float u, float v)
{
    const struct pt_texture *t = &scene->textures[number - 1];
    float s = t->su * u + t->du, w = t->sv * v + t->dv;
    pt_texture_lookups++;
    switch (t->kind) {
    case PT_TEXTURE_IMAGE: return eval_image(scene, t, s, w);
    case PT_TEXTURE_SCALE: return v3_mul(eval_input(scene, &t->in[0], u, v), eval_input(scene, &t->in[1], u, v));
    case PT_TEXTURE_MIX: {
        pt_vec3 amount = eval_input(scene, &t->in[2], u, v);
        pt_vec3 a = eval_input(scene, &t->in[0], u, v), b = eval_input(scene, &t->in[1], u, v);
        return v3_add(v3_mul(v3_sub(v3_splat(1.0f), amount), a), v3_mul(amount, b));
    }
    case PT_TEXTURE_CHECKERBOARD: {
        /* the parity of floor(s) + floor(w), by a remainder that cannot overflow an integer */
        float sum = floorf(s) + floorf(w);
        return eval_input(scene, &t->in[sum - 2.0f * floorf(0.5f * sum) != 0.0f], u, v);
    }
    case PT_TEXTURE_BILERP:
        return blend4(eval_input(scene, &t->in[0], u, v), eval_input(scene, &t->in[1], u, v),
                      eval_input(scene, &t->in[2], u, v), eval_input(scene, &t->in[3], u, v), w, s);
    default: return t->in[0].value;
    }
}

void pt_texture_step(const struct pt_scene *scene, int32_t number, float *step_u, float *step_v)
{
    const struct pt_texture *t = &scene->textures[number - 1];
    *step_u = *step_v = 5e-4f; /* for textures without texels */
    if (t->kind == PT_TEXTURE_IMAGE) {
        const struct pt_image_map *image = &scene->images[t->image];
        float su = fabsf(t->su) * (float)image->width, sv = fabsf(t->sv) * (float)image->height;
        *step_u = su > 0.0f ? 1.0f / su : *step_u;
        *step_v = sv > 0.0f ? 1.0f / sv : *step_v;
        return;
    }
    float finest_u = INFINITY, finest_v = INFINITY;
    for (int i = 0; i < 4; i++) {
        if (t->in[i].texture && t->in[i].texture < number) {
            float du, dv;
            pt_texture_step(scene, t->in[i].texture, &du, &dv);
            finest_u = fminf(finest_u, du);
            finest_v = fminf(finest_v, dv);
        }
    }
    if (isfinite(finest_u) && isfinite(finest_v)) {
        *step_u = finest_u;
        *step_v = finest_v;
    }
}
