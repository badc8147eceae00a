/*
 * Image files through OpenImageIO: the C face of the one C++ file of ggn, which lies in a shared object of its own:
 * OpenImageIO links with hundreds of libraries, whose loading would be nearly all of the time of a command that reads no
 * image. Callers read through data/image.h.
 */
#ifndef GGN_DATA_OIIO_H
#define GGN_DATA_OIIO_H

#include "data/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the shared object holds. The program has its address from there; whoever links with it has it at once. All are
 * thread-safe; on failure nothing is kept. */
struct ggn_oiio_library {
    /* 8-bit codes as stored. Of a file that holds half or float only *is_float is set, and *image stays as it is. */
    int (*read_display)(const char *path, struct ggn_image8 *image, int *is_float, struct base_err *err);
    /* Of such a file: its values. */
    int (*read_linear)(const char *path, struct ggn_imagef *image, struct base_err *err);
    int (*read_channel)(const char *path, const char *channel, struct ggn_imagef *image, struct base_err *err);
};
extern const struct ggn_oiio_library ggn_oiio_library __attribute__((weak, visibility("default")));

#ifdef __cplusplus
}
#endif

#endif
