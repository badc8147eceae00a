/*
 * What lull-images.so holds. OpenImageIO links with hundreds of libraries, whose loading would be nearly all of the time of
 * a program that reads no image: the first read loads them. Callers read through picture/read.h.
 */
#ifndef PICTURE_OIIO_H
#define PICTURE_OIIO_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/err.h"
#include "picture/image.h"

/* What the functions of picture/read.h ask for; light of PIC_DISPLAY is not encoded yet. */
enum pic_wanted { PIC_STORED, PIC_DISPLAY, PIC_CHANNEL, PIC_LAYER };

struct pic_request { /* all borrowed */
    enum pic_wanted wanted;
    const char *name; /* of the file; with data only of the format, and in errors */
    const void *data; /* NULL: the file */
    size_t size;
    const char *channel; /* of PIC_CHANNEL; of PIC_LAYER the layer */
};

/* A program has its address from the shared object; a program linked with its parts has it at once. */
struct pic_library {
    int (*read)(const struct pic_request *request, struct pic_image *out, struct base_err *err);
    int (*read_header)(const char *path, struct pic_window *window, struct pic_attribute *attributes, int count,
                       struct base_err *err);
};
extern const struct pic_library pic_library __attribute__((weak, visibility("default")));

#ifdef __cplusplus
}
#endif

#endif
