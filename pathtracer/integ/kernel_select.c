#include <stddef.h>

#include "integ/kernel_sets.h"

/* From small to large: the first that covers a scene is taken. */
static const struct {
    pt_effects covers;
    pt_kernel *kernel;
    const char *name;
} kernels[] = {
    {PT_FX_SET_DIFFUSE, pt_kernel_diffuse, "diffuse"},
    {PT_FX_SET_SPECULAR, pt_kernel_specular, "specular"},
    {PT_FX_SET_SURFACES, pt_kernel_surfaces, "surfaces"},
    {PT_FX_SET_MEDIA, pt_kernel_media, "media"},
    {PT_FX_SET_NO_MEDIA, pt_kernel_no_media, "no-media"},
    {PT_FX_ALL, pt_kernel_all, "all"},
};

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
