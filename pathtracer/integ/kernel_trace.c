#include "integ/integrator.h"
#include "integ/path.h"

void pt_kernel_trace(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                     uint32_t sample, void (*line)(void *data, const char *text), void *data)
{
    struct pt_trace trace = {line, data, 0};
    struct pt_path_result result;
    pt_path_sample(PT_FX_ALL, scene, settings, x, y, sample, &trace, &result);
}
