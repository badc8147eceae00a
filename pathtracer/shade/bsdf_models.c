#include "shade/bsdf_models.h"

#include "shade/bsdf_dispatch.h"

#define PT_BSDF_ROW(id, name, file_name, words, needs) {file_name, words, needs, pt_##name##_reads},
const struct pt_bsdf_model pt_bsdf_models[PT_BSDF_COUNT] = {PT_BSDFS(PT_BSDF_ROW)};
