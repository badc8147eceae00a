/*
 * Scattering at a surface point: a closure of numbers (textures already evaluated) and the functions on it.
 *
 * Directions are unit vectors in the local shading frame (n = +z); wo points towards the previous vertex, wi towards the
 * next; both point away from the surface. Radiance is transported towards the camera, so refraction carries the factor
 * (eta_i/eta_t)² of radiance compression (Veach 1997, §5.2). Pure functions, thread-safe, no allocation.
 *
 * A model NAME of the list PT_BSDFS (scene/materials.h) is the header bsdf_NAME.h with these inline functions and a table;
 * `fx` is the kernel's compile-time effect set, so that models the scene does not use vanish from its code:
 *   void pt_NAME_closure(fx, scene, material, surface, b)       fills the fields of *b that the model uses
 *   int pt_NAME_has_smooth(b)                                   whether any part of it is not a delta distribution
 *   pt_vec3 pt_NAME_eval(fx, b, wo, wi, pdf_solid)              as pt_bsdf_eval (bsdf_dispatch.h)
 *   int pt_NAME_sample(fx, b, wo, u_lobe, u0, u1, out)          as pt_bsdf_sample; eta_scale 1 and flags 0 are set
 *   pt_vec3 pt_NAME_albedo(b, wo)                               as pt_bsdf_albedo
 *   const struct pt_bsdf_read pt_NAME_reads[]                   what it reads of a scene file
 */
#ifndef PT_SHADE_BSDF_H
#define PT_SHADE_BSDF_H

#include <stddef.h>
#include <stdint.h>

#include "scene/materials.h"

/* Which fields count depends on kind; the others may hold anything. */
struct pt_bsdf {
    int32_t kind;           /* enum pt_bsdf_kind */
    float alpha_x, alpha_y; /* GGX roughness of the (outer) interface, after any remapping; 0 = smooth */
    float eta;              /* index of refraction inside / outside along +z of the (outer) interface; 1 = matched */
    pt_vec3 reflectance;    /* diffuse albedo, or conductor reflectance when given as colour */
    pt_vec3 transmittance;  /* diffuse transmission */
    pt_vec3 eta_rgb, k_rgb; /* complex index of the conductor relative to the medium it lies in */
    float base_alpha_x, base_alpha_y; /* coated conductor: roughness of the metal */
    float thickness, g;               /* coatings: thickness of the layer, Henyey–Greenstein asymmetry inside */
    pt_vec3 albedo;                   /* coatings: single-scattering albedo of the layer; black = clear */
    int32_t more_events;              /* coatings: interactions in the layer beyond PT_LAYER_EVENTS */
    uint32_t walk_key;                /* coatings that are evaluated stochastically: any number, new for every path vertex */
    const float
        *coat_table; /* borrows until scene release: table of the coating (coat_table.h); the walk does without, NULL */
};

enum {
    PT_SCATTER_DELTA = 1,   /* pdf is a density on a discrete set: no MIS, no next-event estimation */
    PT_SCATTER_TRANSMIT = 2 /* wi on the other side */
};

struct pt_bsdf_sample {
    pt_vec3 wi;
    pt_vec3 weight;  /* f |cos θi| / pdf */
    float pdf_solid; /* 1/sr; for DELTA the probability of the choice; see coat_walk.h for walked coatings */
    float eta_scale; /* (eta_i/eta_t)² removed by refraction, for Russian roulette; 1 otherwise */
    uint32_t flags;  /* PT_SCATTER_* */
};

/* A parameter of a model in scene files. Reading and the effects that a material needs both follow from the table. */
enum pt_bsdf_read_kind {
    PT_READ_END,
    PT_READ_COLOUR,         /* a reflectance, into `field` */
    PT_READ_NUMBER,         /* into `field` */
    PT_READ_ASYMMETRY,      /* g of a phase function, into `field` */
    PT_READ_ROUGHNESS,      /* NAMEroughness, NAMEuroughness, NAMEvroughness, remaproughness: roughness_u and _v */
    PT_READ_BASE_ROUGHNESS, /* the same: base_roughness_u and _v */
    PT_READ_INDEX,          /* index of refraction, or a glass's name: eta */
    PT_READ_METAL,          /* reflectance, or NAMEeta and NAMEk: conductor_by_colour … k_rgb */
    PT_READ_SCALE,          /* factor on all colours before it */
    PT_READ_UNSUPPORTED,    /* warns when it is not 0 */
    PT_READ_IGNORED         /* changes nothing here; several names with spaces between them */
};
struct pt_bsdf_read {
    int kind; /* enum pt_bsdf_read_kind */
    const char *name;
    double fallback; /* when the file does not say */
    size_t field;    /* offset of a pt_input in pt_material */
};
#define PT_READ(kind, name, fallback) \
    { \
        PT_READ_##kind, name, fallback, 0 \
    }
#define PT_READ_INTO(field, kind, name, fallback) \
    { \
        PT_READ_##kind, name, fallback, offsetof(struct pt_material, field) \
    }

/* A scattering model, for the scene reader and the explanations. */
struct pt_bsdf_model {
    const char *file_name;            /* in scene files */
    const char *words;                /* for people */
    pt_effects needs;                 /* effects that every use of it needs; its parameters may need more */
    const struct pt_bsdf_read *reads; /* ends with PT_READ_END */
};
extern const struct pt_bsdf_model pt_bsdf_models[PT_BSDF_COUNT]; /* by enum pt_bsdf_kind */

#endif
