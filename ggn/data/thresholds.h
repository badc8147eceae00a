/*
 * Thresholds (or stops) per block of one or more views, from any file that holds them:
 *
 * - CSV `name;t0;…;tN;`, one view per line;
 * - a render's report JSON: `blocks[].spp`, the view is named like the scene's file;
 * - labels.json;
 * - an EXR with `lull.spp.V`.
 */
#ifndef GGN_DATA_THRESHOLDS_H
#define GGN_DATA_THRESHOLDS_H

#include "base/err.h"
#include "data/labels.h"
#include "sequence/manifest.h"

enum { GGN_VIEW_NAME = 128, GGN_VIEW_BLOCKS = 65536 };

struct ggn_view {
    char name[GGN_VIEW_NAME];
    int unnamed;  /* the file does not say what its view is called: name is that of the file */
    int of_study; /* samples of people's study, as which a CSV is taken; else those at which no noise is seen at all, as of
                   * labels and renders (observer/observer.h tells how one becomes the other) */
    int columns;  /* blocks per row; 0 if the file does not say (then a square grid is assumed for pictures) */
    int n;
    double *spp; /* owns; [n], row-major, each > 0; NaN where the file has no value for the block */
};

struct ggn_thresholds {
    int n;
    struct ggn_view *views; /* owns */
};

/* The kind of file is taken from its name: .csv, .json, .exr. block: width and height of a block in pixels, where an EXR
 * does not say it (lull:block). */
int ggn_thresholds_read(const char *path, const int block[2], struct ggn_thresholds *out, struct base_err *err);
/* text is NUL-terminated at text[size]; it is modified. `path` is for messages. */
int ggn_thresholds_parse_csv(const char *path, char *text, size_t size, struct ggn_thresholds *out, struct base_err *err);
void ggn_thresholds_release(struct ggn_thresholds *t);
/* The view of this name, or else of one that is the same (sight/view_name.h). */
const struct ggn_view *ggn_thresholds_of(const struct ggn_thresholds *t, const char *view);

/* Labels of a sequence whose own pictures people judged, of which the last was taken for the truth: thresholds as they are,
 * censored from the last level on. BASE_EINVAL when the row is of another number of blocks or lacks one. */
int ggn_thresholds_label(const struct ggn_view *row, const struct seq_manifest *manifest, struct ggn_labels *labels,
                         struct base_err *err);

#endif
