/*
 * Pictures of rising sample counts, one folder per view, into block sequences: PNG, JPEG, EXR, and the .rawls of SIN3D.
 *
 * A view folder holds NAME_00020.exr …: the number is that of the samples. What is hidden (._NAME_00020.exr) or called
 * otherwise is none of it; a second sequence, a second picture of a level and other formats are refused. EXR and .rawls
 * are linear light, the others sRGB codes. Halves, the mean of the first half of the samples, are either second files
 * NAME_half_00020.exr … or the layer half of an EXR (half.R, half.G, half.B, or half.Y); then the sequence needs no
 * reference. Without halves the last level serves as the reference, and the manifest says that it is not independent.
 */
#ifndef GGN_DATA_IMPORT_H
#define GGN_DATA_IMPORT_H

#include <stddef.h>

#include "data/thresholds.h"
#include "picture/image.h"

struct ggn_import_options {
    int block;                               /* pixels */
    int allow_gaps;                          /* take evenly spaced levels of which some are missing */
    const struct ggn_thresholds *thresholds; /* may be NULL */
    void (*progress)(void *data, const char *view, int done, int of); /* may be NULL */
    void *data;
};

/* Blocks that OUT/manifest.json lists already are kept. *labelled: whether thresholds were found for it. */
int ggn_import_view(const char *dir, const char *out, const struct ggn_import_options *options, int *labelled,
                    struct base_err *err);
/* Pictures of the sequence that a folder holds itself, of several the largest; 0: none. */
int ggn_import_pictures(const char *dir);
/* Whether a folder without them has pictures all the same, with numbers in their names. */
int ggn_import_looks_numbered(const char *dir);
/* Whether its names are those of a view, before any work: BASE_EINVAL as ggn_import_view. */
int ggn_import_check(const char *dir, const struct ggn_import_options *options, struct base_err *err);
/* The group for the split: "p3d_kitchen-view1_part6" -> "p3d_kitchen". */
void ggn_import_scene(const char *view, char *scene, size_t room);

/* A .rawls image. Little endian: "IHDR\n12\n" u32 width u32 height u32 channels "\nCOMMENTS\n" lines "DATA\n" size "\n",
 * then rows of width*channels float32, a newline after each. One or three channels; grey is repeated. Values must be
 * finite. */
int ggn_rawls_parse(const char *path, const char *data, size_t size, struct pic_image *image, struct base_err *err);

#endif
