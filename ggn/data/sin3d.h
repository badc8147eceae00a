/*
 * The public SIN3D layout (one folder per view, one image per level) into block sequences.
 */
#ifndef GGN_DATA_SIN3D_H
#define GGN_DATA_SIN3D_H

#include <stddef.h>

#include "data/thresholds.h"

struct ggn_sin3d_options {
    int block;                                                        /* pixels */
    int allow_gaps;                                                   /* take levels that are not evenly spaced */
    const struct ggn_thresholds *thresholds;                          /* may be NULL */
    void (*progress)(void *data, const char *view, int done, int of); /* may be NULL */
    void *data;
};

/* A view folder holds NAME_00020.png (or .rawls) …; the last level serves as the reference. Blocks that OUT/manifest.json
 * lists already are kept. *labelled: whether thresholds were found for it. */
int ggn_sin3d_import_view(const char *dir, const char *out, const struct ggn_sin3d_options *options, int *labelled,
                          struct base_err *err);
/* Whether a folder holds such images itself. */
int ggn_sin3d_is_view(const char *dir);
/* The group for the split: "p3d_kitchen-view1_part6" -> "p3d_kitchen". */
void ggn_sin3d_scene(const char *view, char *scene, size_t room);

#endif
