/*
 * A data set: a folder of recorded sequences, their labels, and the split by scene.
 *
 * DATA/NAME/manifest.json (+ labels.json) for each view, and DATA/split.json:
 *     { "train": ["scene", …], "validation": ["scene", …], "test": ["scene", …] }
 * Instead of split.json the views may lie in DATA/train, DATA/validation, DATA/test and DATA/people (scripts/lab data-set
 * does so). A scene is on one side only; scenes that are on none are not used, and scenes of split.json that are not there
 * do no harm. DATA may also be one sequence itself.
 *
 * Which side a scene is on is said by the first that there is of:
 *
 * - the scenes that the command line lists, each over what comes below;
 * - the data set's own split;
 * - the scenes that the models at hand were made with: one that any of them learned from is for training, one that any was
 *   validated on for validation, and a scene that none has met for test;
 * - every fifth scene is for validation, unless the command line lists others.
 */
#ifndef GGN_DATA_DATASET_H
#define GGN_DATA_DATASET_H

#include "data/labels.h"
#include "sequence/manifest.h"

struct cJSON;

enum ggn_split { GGN_SPLIT_TRAIN, GGN_SPLIT_VALIDATION, GGN_SPLIT_TEST, GGN_SPLIT_PEOPLE, GGN_SPLIT_NONE, GGN_SPLITS };
extern const char *const ggn_split_names[GGN_SPLITS]; /* "train", "validation", "test", "people", "none" */

struct ggn_dataset_view {
    char dir[4096];
    const char *name; /* borrows from dir: its last component */
    int scene, first; /* number of its scene, in order of first appearance; the first view of that */
    struct seq_manifest manifest;
    int has_labels;
    struct ggn_labels labels;
    enum ggn_split split;
};

struct ggn_dataset {
    int n, n_scenes;
    struct ggn_dataset_view *views; /* owns; in order of name */
};

/* Reads manifests, labels and split (no pixels). Without a split all views are in GGN_SPLIT_NONE. */
int ggn_dataset_open(const char *path, struct ggn_dataset *data, struct base_err *err);
void ggn_dataset_release(struct ggn_dataset *data);

/* How many blocks the view has when it is whole: thresholds for it are as many. */
uint32_t ggn_dataset_tiles(const struct ggn_dataset_view *view);

/* Whose thresholds they are: "human", "observer", "mixed" or "none". */
const char *ggn_dataset_label_source(const struct ggn_dataset *data);

enum ggn_split_source { GGN_SPLIT_BY_DATA, GGN_SPLIT_BY_MODELS, GGN_SPLIT_BY_FIFTHS, GGN_SPLIT_SOURCES };
extern const char *const ggn_split_sources[GGN_SPLIT_SOURCES]; /* for people */

struct ggn_split_options {
    const char *validation, *test;      /* comma-separated scenes, or NULL */
    const struct cJSON *const *learned; /* [n_learned] "data" of the models' provenance; NULL: not known */
    int n_learned;
};

/* Sets the views' sides. BASE_EINVAL names a scene that is not there, or that is in both lists. */
int ggn_split_choose(struct ggn_dataset *data, const struct ggn_split_options *options, enum ggn_split_source *source,
                     struct base_err *err);

/* The list that a scene is in; GGN_SPLIT_NONE: it is in none. learned: NULL, or as above. */
enum ggn_split ggn_split_learned(const struct cJSON *learned, const char *scene);

#endif
