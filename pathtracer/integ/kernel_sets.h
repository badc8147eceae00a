/* The compiled kernels: each kernel_NAME.c is the path kernel for one effect set. */
#ifndef PT_INTEG_KERNEL_SETS_H
#define PT_INTEG_KERNEL_SETS_H

#include "integ/integrator.h"

/* Diffuse surfaces lit by area lights: the classic Cornell box. */
#define PT_FX_SET_DIFFUSE (PT_FX_MANY_LIGHTS)
/* Textured interiors: all surfaces, no media, nothing moves. */
#define PT_FX_SET_SURFACES \
    (PT_FX_MANY_LIGHTS | PT_FX_TEXTURE | PT_FX_BUMP | PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TRANSMISSION | PT_FX_COATED | \
     PT_FX_ENVIRONMENT | PT_FX_DELTA_LIGHT | PT_FX_QUADRIC | PT_FX_DEFOCUS)
/* The same with glass that absorbs, or in fog. */
#define PT_FX_SET_MEDIA (PT_FX_SET_SURFACES | PT_FX_ABSORPTION | PT_FX_SCATTERING)
/* The same with glass that stands on something. */
#define PT_FX_SET_CONTACT (PT_FX_SET_MEDIA | PT_FX_CONTACT)
/* Plain (untextured) mirrors and glass among diffuse surfaces. */
#define PT_FX_SET_SPECULAR (PT_FX_MANY_LIGHTS | PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TRANSMISSION | PT_FX_QUADRIC)
/* Everything but media. */
#define PT_FX_SET_NO_MEDIA (PT_FX_ALL & ~(pt_effects)(PT_FX_MEDIA | PT_FX_INTERFACE))

/* X(name, name for people, effects), from small to large: the first that covers a scene is taken. */
#define PT_KERNELS(X) \
    X(diffuse, "diffuse", PT_FX_SET_DIFFUSE) \
    X(specular, "specular", PT_FX_SET_SPECULAR) \
    X(surfaces, "surfaces", PT_FX_SET_SURFACES) \
    X(media, "media", PT_FX_SET_MEDIA) \
    X(contact, "contact", PT_FX_SET_CONTACT) \
    X(no_media, "no-media", PT_FX_SET_NO_MEDIA) \
    X(all, "all", PT_FX_ALL)

#define PT_KERNEL_DECLARE(name, text, set) pt_kernel pt_kernel_##name;
PT_KERNELS(PT_KERNEL_DECLARE)

#endif
