#include "integ/effects.h"

const char *pt_effects_name(int i)
{
    static const char *const names[PT_FX_COUNT] = {
        "texture",     "alpha",       "bump",        "specular", "glossy",  "transmission", "coated",
        "mix",         "environment", "delta-light", "many-lights", "quadric", "absorption", "scattering",
        "grid-medium", "defocus",     "motion",      "instances", "interface",
    };
    return names[i];
}
