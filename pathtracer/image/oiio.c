#include "image/oiio.h"

#include <stdlib.h>

#include "base/module.h"

/* NULL when it cannot be loaded. */
static const struct pt_oiio_library *library(void)
{
    const struct pt_oiio_library *linked = &pt_oiio_library;
    return linked ? linked : base_module_symbol("lull-images.so", "pt_oiio_library", 0);
}

static int no_library(const char *name, struct base_err *err)
{
    return base_fail(err, BASE_EIO,
                     "%s: images cannot be read: lib/lull-images.so, which belongs beside this program's "
                     "bin/, or OpenImageIO cannot be loaded",
                     name);
}

int pt_oiio_read(const char *path, struct pt_oiio_image *out, struct base_err *err)
{
    const struct pt_oiio_library *l = library();
    return l ? l->read(path, out, err) : no_library(path, err);
}

int pt_oiio_read_memory(const char *name, const void *data, size_t size, struct pt_oiio_image *out, struct base_err *err)
{
    const struct pt_oiio_library *l = library();
    return l ? l->read_memory(name, data, size, out, err) : no_library(name, err);
}

void pt_oiio_release(struct pt_oiio_image *image)
{
    free(image->u8);
    free(image->f32);
    *image = (struct pt_oiio_image){0};
}
