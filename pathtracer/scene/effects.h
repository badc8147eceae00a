/*
 * The effects a scene can call for, one bit each. A loaded scene carries the set it needs; the path kernel is compiled for
 * several sets with the set as a compile-time constant, so that code for an absent effect does not exist in it.
 */
#ifndef PT_SCENE_EFFECTS_H
#define PT_SCENE_EFFECTS_H

#include <stdint.h>

typedef uint32_t pt_effects;

/* X(ID, name, what it costs a kernel that has it): the name and the cost are for --explain. */
#define PT_EFFECTS(X) \
    X(TEXTURE, "texture", "a lookup per textured input at each hit") /* any texture that is not constant */ \
    /* alpha masks: hits that may be passed through */ \
    X(ALPHA, "alpha", "the ray goes on behind a hit that is let through; shadow rays become closest-hit queries") \
    X(BUMP, "bump", "two or three more lookups at each hit, a new frame") /* bump (displacement) and normal maps */ \
    X(SPECULAR, "specular", "a test at each hit: no light sampling, no density there") /* delta reflection */ \
    X(GLOSSY, "glossy", "a microfacet normal, its density for each light sample")      /* rough (microfacet) reflection */ \
    /* dielectric, thin dielectric, diffuse transmission */ \
    X(TRANSMISSION, "transmission", "a Fresnel choice, refraction; more bounces until a path ends") \
    X(COATED, "coated", "two lobes or a walk through the layer, also for each light sample") /* layered coatings */ \
    X(MIX, "mix", "a lookup and a random choice at each hit")                                /* mix materials */ \
    /* infinite lights, constant or image */ \
    X(ENVIRONMENT, "environment", "a table search per light sample, a lookup per escaping ray") \
    X(DELTA_LIGHT, "delta-light", "no density to weigh by; cheap") /* point, spot, distant lights */ \
    /* more than one light: selection needed */ \
    X(MANY_LIGHTS, "many-lights", "a choice per light sample (see light selection), its probability per emitter hit") \
    /* spheres, disks, cylinders kept analytic */ \
    X(QUADRIC, "quadric", "double-precision intersection, in a callback of the ray query") \
    /* participating media without scattering */ \
    X(ABSORPTION, "absorption", "an exponential per segment, a stack of media") \
    /* media that scatter */ \
    X(SCATTERING, "scattering", "a distance sample per segment, a light sample per collision; many more bounces") \
    X(GRID_MEDIUM, "grid-medium", "tracking by many small steps, three lookups each")  /* media of varying density */ \
    X(DEFOCUS, "defocus", "two random numbers per camera ray")                         /* depth of field */ \
    X(MOTION, "motion", "one random number per path, interpolation in each ray query") /* motion blur */ \
    X(INSTANCES, "instances", "a change of space per ray and hit")                     /* object instances */ \
    X(INTERFACE, "interface", "shadow rays cross surfaces one by one")                 /* surfaces that only bound media */ \
    /* surfaces that let rays through where others are */ \
    X(CONTACT, "contact", "a ray behind each hit of a surface that touches another one")

/* PT_FX_ID is a bit, PT_FX_INDEX_ID its number. */
#define PT_FX_INDEX(id, name, cost) PT_FX_INDEX_##id,
enum { PT_EFFECTS(PT_FX_INDEX) PT_FX_COUNT };
#define PT_FX_BIT(id, name, cost) PT_FX_##id = 1 << PT_FX_INDEX_##id,
enum { PT_EFFECTS(PT_FX_BIT) PT_FX_ALL = (1 << PT_FX_COUNT) - 1 };

#define PT_FX_MEDIA (PT_FX_ABSORPTION | PT_FX_SCATTERING | PT_FX_GRID_MEDIUM)

/* Short name ("texture", "alpha", …) of bit i in [0, PT_FX_COUNT). Static text. */
const char *pt_effects_name(int i);
/* In words. Static text. */
const char *pt_effects_cost(int i);

#endif
