/* The .rawls float images of the SIN3D renderings. */
#ifndef GGN_DATA_RAWLS_H
#define GGN_DATA_RAWLS_H

#include "base/err.h"
#include "picture/image.h"

/* Little endian: "IHDR\n12\n" u32 width u32 height u32 channels "\nCOMMENTS\n" lines "DATA\n" size "\n", then rows of
 * width*channels float32, a newline after each. One or three channels; grey is repeated. Values must be finite. */
int ggn_rawls_parse(const char *path, const char *data, size_t size, struct pic_image *image, struct base_err *err);
int ggn_rawls_read(const char *path, struct pic_image *image, struct base_err *err);

#endif
