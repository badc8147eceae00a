#include "integ/kernel_sets.h"
#include "integ/path.h"

void pt_kernel_all(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                   uint32_t sample, struct pt_path_result *out)
{
    pt_path_sample(PT_FX_ALL, scene, settings, x, y, sample, NULL, out);
}
