/*
 * Materials as plain data: which model, and its parameters, each a constant or a texture. A zeroed parameter is the constant
 * 0.
 */
#ifndef PT_SCENE_MATERIALS_H
#define PT_SCENE_MATERIALS_H

#include <stdint.h>

#include "scene/effects.h"
#include "scene/vec.h"

/*
 * X(ID, name, scene file's name, words for --debug-path, effects that every use of it needs): the scattering models. A line
 * here and shade/bsdf_NAME.h are all of a model (README.md says what is in it): kinds, dispatch (shade/bsdf_dispatch.h),
 * reading (shade/bsdf.h) come from the list.
 */
#define PT_BSDFS(X) \
    X(DIFFUSE, diffuse, "diffuse", "diffuse", 0) \
    X(CONDUCTOR, conductor, "conductor", "conductor", 0) \
    X(DIELECTRIC, dielectric, "dielectric", "dielectric", PT_FX_TRANSMISSION) \
    X(THIN_DIELECTRIC, thin_dielectric, "thindielectric", "thin dielectric", PT_FX_TRANSMISSION | PT_FX_SPECULAR) \
    X(DIFFUSE_TRANSMISSION, diffuse_transmission, "diffusetransmission", "diffuse transmission", PT_FX_TRANSMISSION) \
    X(COATED_DIFFUSE, coated_diffuse, "coateddiffuse", "coated diffuse", PT_FX_COATED) \
    X(COATED_CONDUCTOR, coated_conductor, "coatedconductor", "coated conductor", PT_FX_COATED)

#define PT_BSDF_ID(id, name, file_name, words, needs) PT_BSDF_##id,
enum pt_bsdf_kind { PT_BSDFS(PT_BSDF_ID) PT_BSDF_COUNT };

enum pt_material_kind { /* a model, or */
                        PT_MATERIAL_MIX = PT_BSDF_COUNT,
                        PT_MATERIAL_INTERFACE /* bounds media only: light passes */
};

/* A number or colour that may be textured. */
struct pt_input {
    int32_t texture; /* 0: `value`; else number of the texture: pt_scene.textures[number - 1] */
    pt_vec3 value;   /* a float input has it in x (and y, z equal to x) */
};

struct pt_material {
    int32_t kind;                /* enum pt_bsdf_kind or pt_material_kind */
    int32_t remap_roughness;     /* GGX alpha = sqrt(roughness) as in pbrt-v4; 0: alpha = roughness */
    int32_t conductor_by_colour; /* conductor (or base of a coated one) given by reflectance instead of eta and k */
    int32_t bump;                /* number of the displacement texture (scene units), 0 = none */
    int32_t normal_map;          /* number of a texture with rgb = (n + 1)/2 in tangent space, 0 = none */
    int32_t mix_a, mix_b;        /* ids of materials, MIX only; smaller than this one's */
    struct pt_input mix_amount;  /* float: share of mix_b */
    struct pt_input reflectance, transmittance;
    struct pt_input roughness_u, roughness_v;
    struct pt_input base_roughness_u, base_roughness_v; /* coated conductor: the metal */
    struct pt_input eta_rgb, k_rgb;                     /* conductor */
    struct pt_input thickness, g, albedo;               /* coatings */
    struct pt_input max_depth;                          /* coatings: interactions in the layer, 0 = as many as by default */
    float eta;                                          /* dielectric interface, inside / outside */
    const float *coat_table; /* see pt_bsdf.coat_table; made by shade/, in the arena or static; NULL = none */
};

#endif
