/*
 * Scattering at a surface point: a closure of numbers (textures already evaluated) and the functions on it.
 *
 * Directions are unit vectors in the local shading frame (n = +z); wo points towards the previous vertex, wi towards the
 * next; both point away from the surface. Radiance is transported towards the camera, so refraction carries the factor
 * (eta_i/eta_t)² of radiance compression (Veach 1997, §5.2). Pure functions, thread-safe, no allocation.
 *
 * One header per model (bsdf_diffuse.h …) with inline functions; the dispatchers here take the effect set `fx` as first
 * argument, which the kernel passes as a compile-time constant, so that models the scene does not use vanish from its code.
 */
#ifndef PT_SHADE_BSDF_H
#define PT_SHADE_BSDF_H

#include <stdint.h>

#include "scene/vec.h"
#include "scene/effects.h"

enum pt_bsdf_kind {
    PT_BSDF_DIFFUSE,
    PT_BSDF_CONDUCTOR,            /* smooth when alpha_x and alpha_y are 0, GGX otherwise */
    PT_BSDF_DIELECTRIC,           /* likewise */
    PT_BSDF_THIN_DIELECTRIC,
    PT_BSDF_DIFFUSE_TRANSMISSION,
    PT_BSDF_COATED_DIFFUSE,
    PT_BSDF_COATED_CONDUCTOR
};

/* Which fields count depends on kind; the others may hold anything. */
struct pt_bsdf {
    int32_t kind;             /* enum pt_bsdf_kind */
    float alpha_x, alpha_y;   /* GGX roughness of the (outer) interface, after any remapping; 0 = smooth */
    float eta;                /* index of refraction inside / outside along +z of the (outer) interface; 1 = matched */
    pt_vec3 reflectance;      /* diffuse albedo, or conductor reflectance when given as colour */
    pt_vec3 transmittance;    /* diffuse transmission */
    pt_vec3 eta_rgb, k_rgb;   /* complex index of the conductor relative to the medium it lies in */
    float base_alpha_x, base_alpha_y; /* coated conductor: roughness of the metal */
    float thickness, g;       /* coatings: thickness of the layer, Henyey–Greenstein asymmetry inside */
    pt_vec3 albedo;           /* coatings: single-scattering albedo of the layer; black = clear */
    uint32_t walk_key;        /* coatings: any number, new for every path vertex (models that are evaluated stochastically) */
    const float *coat_table;  /* borrows until scene release: table of the coating (coat_table.h), may be NULL but for coated diffuse */
};

enum {
    PT_SCATTER_DELTA = 1,    /* pdf is a density on a discrete set: no MIS, no next-event estimation */
    PT_SCATTER_TRANSMIT = 2  /* wi on the other side */
};

struct pt_bsdf_sample {
    pt_vec3 wi;
    pt_vec3 weight;  /* f |cos θi| / pdf */
    float pdf_solid; /* 1/sr; for DELTA the probability of the choice; see bsdf_coated_walk.h for walked coatings */
    float eta_scale; /* (eta_i/eta_t)² removed by refraction, for Russian roulette; 1 otherwise */
    uint32_t flags;  /* PT_SCATTER_* */
};

#endif
