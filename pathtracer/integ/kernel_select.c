#include <stddef.h>

#include "integ/kernel_sets.h"

#define PT_KERNEL_ROW(name, text, set) {set, pt_kernel_##name, text},
static const struct {
    pt_effects covers;
    pt_kernel *kernel;
    const char *name;
} kernels[] = {PT_KERNELS(PT_KERNEL_ROW)};

pt_kernel *pt_kernel_select(pt_effects needed, pt_effects *covers, const char **name)
{
    size_t i = 0;
    while ((needed & ~kernels[i].covers & PT_FX_ALL) != 0)
        i++;
    if (covers)
        *covers = kernels[i].covers;
    if (name)
        *name = kernels[i].name;
    return kernels[i].kernel;
}
