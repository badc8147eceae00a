/*
 * The effects a scene can call for, one bit each. A loaded scene carries the set it needs; the path kernel is compiled for
 * several sets with the set as a compile-time constant, so that code for an absent effect does not exist in it.
 */
#ifndef PT_SCENE_EFFECTS_H
#define PT_SCENE_EFFECTS_H

#include <stdint.h>

typedef uint32_t pt_effects;

enum {
    PT_FX_TEXTURE = 1 << 0,       /* any texture that is not constant */
    PT_FX_ALPHA = 1 << 1,         /* alpha masks: hits that may be passed through */
    PT_FX_BUMP = 1 << 2,          /* bump (displacement) and normal maps */
    PT_FX_SPECULAR = 1 << 3,      /* delta reflection */
    PT_FX_GLOSSY = 1 << 4,        /* rough (microfacet) reflection */
    PT_FX_TRANSMISSION = 1 << 5,  /* dielectric, thin dielectric, diffuse transmission */
    PT_FX_COATED = 1 << 6,        /* layered coatings */
    PT_FX_MIX = 1 << 7,           /* mix materials */
    PT_FX_ENVIRONMENT = 1 << 8,   /* infinite lights, constant or image */
    PT_FX_DELTA_LIGHT = 1 << 9,   /* point, spot, distant lights */
    PT_FX_MANY_LIGHTS = 1 << 10,  /* more than one light: selection needed */
    PT_FX_QUADRIC = 1 << 11,      /* spheres, disks, cylinders kept analytic */
    PT_FX_ABSORPTION = 1 << 12,   /* participating media without scattering */
    PT_FX_SCATTERING = 1 << 13,   /* media that scatter */
    PT_FX_GRID_MEDIUM = 1 << 14,  /* media of varying density */
    PT_FX_DEFOCUS = 1 << 15,      /* depth of field */
    PT_FX_MOTION = 1 << 16,       /* motion blur */
    PT_FX_INSTANCES = 1 << 17,    /* object instances */
    PT_FX_INTERFACE = 1 << 18,    /* surfaces that only bound media */
    PT_FX_COUNT = 19,
    PT_FX_ALL = (1 << PT_FX_COUNT) - 1
};

#define PT_FX_MEDIA (PT_FX_ABSORPTION | PT_FX_SCATTERING | PT_FX_GRID_MEDIUM)

/* Short name ("texture", "alpha", …) of bit i in [0, PT_FX_COUNT). Static text. */
const char *pt_effects_name(int i);
/* What the effect costs a kernel that has it, in words. Static text. */
const char *pt_effects_cost(int i);

#endif
