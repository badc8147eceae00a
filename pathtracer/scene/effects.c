#include "scene/effects.h"

const char *pt_effects_name(int i)
{
    static const char *const names[PT_FX_COUNT] = {
        "texture",     "alpha",       "bump",        "specular", "glossy",  "transmission", "coated",
        "mix",         "environment", "delta-light", "many-lights", "quadric", "absorption", "scattering",
        "grid-medium", "defocus",     "motion",      "instances", "interface",
    };
    return names[i];
}

const char *pt_effects_cost(int i)
{
    static const char *const costs[PT_FX_COUNT] = {
        "a lookup per textured input at each hit",
        "the ray goes on behind a hit that is let through; shadow rays become closest-hit queries",
        "two or three more lookups at each hit, a new frame",
        "a test at each hit: no light sampling, no density there",
        "a microfacet normal, its density for each light sample",
        "a Fresnel choice, refraction; more bounces until a path ends",
        "two lobes or a walk through the layer, also for each light sample",
        "a lookup and a random choice at each hit",
        "a table search per light sample, a lookup per escaping ray",
        "no density to weigh by; cheap",
        "a choice by power per light sample, its probability per emitter hit",
        "double-precision intersection, in a callback of the ray query",
        "an exponential per segment, a stack of media",
        "a distance sample per segment, a light sample per collision; many more bounces",
        "tracking by many small steps, three lookups each",
        "two random numbers per camera ray",
        "one random number per path, interpolation in each ray query",
        "a change of space per ray and hit",
        "shadow rays cross surfaces one by one",
    };
    return costs[i];
}
