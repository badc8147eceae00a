#include "integ/run.h"

void pt_kernel_trace(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                     uint32_t sample, FILE *out, uint64_t *met)
{
    struct pt_trace trace = {.out = out};
    struct pt_path_result result;
    pt_run_sample(PT_FX_ALL, scene, settings, x, y, 1, sample, &trace, &result);
    for (int i = 0; met && i < PT_MET_COUNT; i++)
        met[i] += trace.met[i];
}
