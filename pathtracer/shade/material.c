#include "shade/material.h"

#include "shade/bsdf_dispatch.h"
#include "shade/coat_table.h"

#define PT_BSDF_ROW(id, name, file_name, words, needs) {file_name, words, needs, pt_##name##_reads},
const struct pt_bsdf_model pt_bsdf_models[PT_BSDF_COUNT] = {PT_BSDFS(PT_BSDF_ROW)};

/* Unit, on the side of the geometric normal; `fallback` when there is no direction left. */
static pt_vec3 keep_side(pt_vec3 n, pt_vec3 n_geometric, pt_vec3 fallback)
{
    n = v3_norm(n);
    if (!v3_is_finite(n) || v3_is_black(n))
        return fallback;
    return v3_dot(n, n_geometric) < 0.0f ? v3_neg(n) : n;
}

static pt_vec3 normal_from_map(const struct pt_scene *scene, const struct pt_material *m, const struct pt_surface *s)
{
    pt_vec3 n = v3_sub(v3_scale(pt_texture_eval(scene, m->normal_map, s->u, s->v), 2.0f), v3_splat(1.0f));
    pt_vec3 tangent = v3_norm(v3_madd(s->dpdu, -v3_dot(s->dpdu, s->n_shading), s->n_shading));
    /* green points where v grows, on whichever side of the surface dpdu × dpdv is */
    pt_vec3 across = v3_cross(s->n_shading, tangent);
    struct pt_frame frame = {tangent, v3_dot(across, s->dpdv) < 0.0f ? v3_neg(across) : across, s->n_shading};
    return keep_side(pt_frame_to_world(&frame, v3_norm(n)), s->n_geometric, s->n_shading);
}

pt_vec3 pt_material_bumped_normal(const struct pt_scene *scene, const struct pt_material *m, const struct pt_surface *s)
{
    if (m->normal_map)
        return normal_from_map(scene, m, s);
    float du, dv;
    pt_texture_step(scene, m->bump, &du, &dv);
    float d = pt_texture_eval(scene, m->bump, s->u, s->v).x;
    float slope_u = (pt_texture_eval(scene, m->bump, s->u + du, s->v).x - d) / du;
    float slope_v = (pt_texture_eval(scene, m->bump, s->u, s->v + dv).x - d) / dv;
    pt_vec3 tangent_u = v3_madd(s->dpdu, slope_u, s->n_shading), tangent_v = v3_madd(s->dpdv, slope_v, s->n_shading);
    /* dpdu × dpdv may be on either side of the surface */
    return keep_side(v3_cross(tangent_u, tangent_v), s->n_geometric, s->n_shading);
}

static pt_effects input_effects(const struct pt_input *in) { return in->texture ? PT_FX_TEXTURE : 0; }

/* Whether a roughness can be smooth, can be rough, as effects. */
static pt_effects roughness_effects(const struct pt_material *m, const struct pt_input *u, const struct pt_input *v)
{
    if (u->texture || v->texture)
        return PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TEXTURE;
    float x = fmaxf(u->value.x, v->value.x);
    return (m->remap_roughness ? pt_roughness_to_alpha(x) : x) >= PT_ALPHA_SMOOTH ? PT_FX_GLOSSY : PT_FX_SPECULAR;
}

static pt_effects read_effects(const struct pt_material *m, const struct pt_bsdf_read *read)
{
    switch (read->kind) {
    case PT_READ_COLOUR:
    case PT_READ_NUMBER:
    case PT_READ_ASYMMETRY: return input_effects((const struct pt_input *)((const char *)m + read->field));
    case PT_READ_ROUGHNESS: return roughness_effects(m, &m->roughness_u, &m->roughness_v);
    case PT_READ_BASE_ROUGHNESS: return roughness_effects(m, &m->base_roughness_u, &m->base_roughness_v);
    case PT_READ_METAL:
        return m->conductor_by_colour ? input_effects(&m->reflectance)
                                      : input_effects(&m->eta_rgb) | input_effects(&m->k_rgb);
    default: return 0;
    }
}

pt_effects pt_material_effects(const struct pt_scene *scene, int32_t id)
{
    const struct pt_material *m = &scene->materials[id];
    if (m->kind == PT_MATERIAL_INTERFACE)
        return PT_FX_INTERFACE;
    if (m->kind == PT_MATERIAL_MIX) /* smaller ids: the recursion ends */
        return PT_FX_MIX | input_effects(&m->mix_amount) | pt_material_effects(scene, m->mix_a) |
               pt_material_effects(scene, m->mix_b);
    pt_effects fx = pt_bsdf_models[m->kind].needs | (m->bump || m->normal_map ? PT_FX_BUMP | PT_FX_TEXTURE : 0);
    for (const struct pt_bsdf_read *read = pt_bsdf_models[m->kind].reads; read->kind != PT_READ_END; read++)
        fx |= read_effects(m, read);
    return fx;
}

struct coat_key {
    float eta, thickness, alpha_min, alpha_max;
    int rows;
};

static struct coat_key coat_key(const struct pt_scene *scene, const struct pt_material *m)
{
    struct coat_key key = {m->eta, fmaxf(0.0f, m->thickness.value.x), 0.0f, 1.0f, PT_COAT_TEXTURED_ROWS};
    if (!m->roughness_u.texture && !m->roughness_v.texture) {
        float ax, ay;
        pt_material_alpha(0, scene, m, &m->roughness_u, &m->roughness_v, &(struct pt_surface){0}, &ax, &ay);
        key.alpha_min = key.alpha_max = pt_coat_alpha(ax, ay);
        key.rows = 1;
    }
    return key;
}

static const float *find_table(const struct pt_scene *scene, int32_t before, const struct coat_key *key)
{
    for (int32_t i = 0; i < before; i++) {
        const struct pt_material *m = &scene->materials[i];
        struct coat_key k = coat_key(scene, m);
        if (m->coat_table && k.eta == key->eta && k.thickness == key->thickness && k.alpha_min == key->alpha_min &&
            k.alpha_max == key->alpha_max && k.rows == key->rows)
            return m->coat_table;
    }
    return NULL;
}

int pt_materials_build(struct pt_scene *scene, struct base_err *err)
{
    for (int32_t i = 0; i < scene->material_count; i++) {
        struct pt_material *m = &scene->materials[i];
        m->reflectance.value = pt_clamp_unit(m->reflectance.value);
        m->transmittance.value = pt_clamp_unit(m->transmittance.value);
        m->albedo.value = pt_clamp_unit(m->albedo.value);
        m->coat_table = NULL;
        if (m->kind != PT_BSDF_COATED_DIFFUSE || m->thickness.texture)
            continue;
        struct coat_key key = coat_key(scene, m);
        m->coat_table = find_table(scene, i, &key);
        if (m->coat_table)
            continue;
        float *table = pt_arena_alloc(&scene->arena, pt_coat_table_floats(key.rows), sizeof(float));
        if (!table)
            return base_fail_nomem(err, "the table of a coating");
        pt_coat_table_build(table, key.rows, key.eta, key.thickness, key.alpha_min, key.alpha_max);
        m->coat_table = table;
    }
    return 0;
}
