/*
 * Which channels of a file are its picture: their names say it, since films have many layers, in any order. Thread-safe.
 *
 * A name is LAYER.CHANNEL; without a dot, or with nothing before it, the channel belongs to the file's own layer. A layer is
 * a colour picture if it has R, G and B (or red, green and blue), a grey one if it has one of these or Y, L or luminance. A
 * is its alpha. Other channels are no picture, whatever their place: depth, normals, numbers.
 */
#ifndef PICTURE_CHANNELS_H
#define PICTURE_CHANNELS_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/err.h"

struct pic_channel { /* all borrowed */
    const char *name;
    const char *part_name; /* names its own layer in files of several parts; NULL: none */
    int part, at;          /* the at-th channel of the part */
};

struct pic_choice {
    int part, count, at[4]; /* of that part: grey; grey, alpha; red, green, blue; red, green, blue, alpha */
};

enum { PIC_MAX_CHANNELS = 4096 };

/* The first part's own layer if it is a picture; else the one layer that is a colour picture, or of several the one called
 * Combined, or of several of those Blender's Composite.Combined; else the one that is a grey picture; else the only channel,
 * of any name. BASE_EINVAL, naming layers or channels, when that does not tell, BASE_ENOMEM. file: named in errors. */
int pic_choose_channels(const char *file, const struct pic_channel *list, int count, struct pic_choice *out,
                        struct base_err *err);
/* The layer of this name, or the first whose last words it is ("ViewLayer.half" and a part "half" are "half"), in any case:
 * red, green and blue, or its luminance thrice. "": those of a part's own layer. */
int pic_choose_layer(const char *file, const char *name, const struct pic_channel *list, int count, struct pic_choice *out,
                     struct base_err *err);

#ifdef __cplusplus
}
#endif

#endif
