/* The scattering models as a table, for the scene reader and the explanations. Static data. */
#ifndef PT_SHADE_BSDF_MODELS_H
#define PT_SHADE_BSDF_MODELS_H

#include "shade/bsdf.h"

struct pt_bsdf_model {
    const char *file_name;            /* in scene files */
    const char *words;                /* for people */
    pt_effects needs;                 /* effects that every use of it needs; its parameters may need more */
    const struct pt_bsdf_read *reads; /* ends with PT_READ_END */
};
extern const struct pt_bsdf_model pt_bsdf_models[PT_BSDF_COUNT]; /* by enum pt_bsdf_kind */

#endif
