/*
 * Which side each scene of a data set is on. What decides, the first that there is:
 *
 * - the scenes that the command line lists, each over what comes below;
 * - the data set's own split (data/dataset.h);
 * - the scenes that the models at hand were made with: one that any of them learned from is for training, one that any was
 *   validated on for validation, and a scene that none has met for test;
 * - every fifth scene is for validation, unless the command line lists others.
 */
#ifndef GGN_DATA_SPLIT_H
#define GGN_DATA_SPLIT_H

#include "data/dataset.h"

struct cJSON;

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
