/*
 * A small data set made from nothing: textured blocks with noise that shrinks like that of a path tracer, in the form of
 * plugin-api/sequence/FORMAT.md, labelled by a known rule. Same options, same bytes.
 *
 * `make train-demo` learns from one that is kept in tests/data/train-demo (see tests/unit/ggn_train_data.c, --write-demo).
 */
#ifndef TESTS_SUPPORT_GGN_SEQGEN_H
#define TESTS_SUPPORT_GGN_SEQGEN_H

#include "base/err.h"
#include "data/series.h"

struct seqgen {
    int side;                     /* of a block, pixels */
    int scenes, validation, test; /* the last `test` scenes are for testing, the `validation` before them for validation */
    int blocks;                   /* per scene, side by side */
    double first, ratio;          /* levels */
    int levels;
    unsigned reference_spp; /* 0: no reference */
    double tau;             /* rms noise in display units at which it stops being visible */
    unsigned seed;
};

struct seqgen seqgen_default(void);
/* Makes DIR/sceneN/… and DIR/split.json. */
int seqgen_write(const char *dir, const struct seqgen *g, struct base_err *err);

/* Before and after a group of tests: the default one, in a folder of its own. */
extern char seqgen_dir[64];
int seqgen_make(void **state);
int seqgen_remove(void **state);
/* Reads it; the test fails where that does not go. ratio: as in struct ggn_series_set_options. */
void seqgen_load(struct ggn_series_set *set, double ratio);

#endif
