/*
 * What surrounds a picture that a model judges: size of the blocks, display. A model knows those that it has
 * learned with; others are none of its business unless somebody says so. Pure functions, any thread.
 *
 * Exposure is not among them: it is part of what is seen, as the lamps' strength is, and models learn with both.
 */
#ifndef GGN_MODEL_SETTING_H
#define GGN_MODEL_SETTING_H

#include <stddef.h>

#include "model/policy.h"
#include "model/preprocess.h"

struct ggn_setting {
    int width, height; /* of a whole block */
    enum ggn_transfer transfer;
};

/* Puts into `text` in which way `here` is another setting than the learned one, "blocks of 64x64 pixels instead of 200x200,
 * a gamma instead of sRGB", and returns the length: 0 where nothing is. */
size_t ggn_setting_difference(const struct ggn_setting *learned, const struct ggn_setting *here, char *text, size_t room);

/* Where levels, rising, are not those that a policy asks for: from the first image on, each next one is looked for, and the
 * nearest level must be less than half a step or one sample away. Returns 1 with the first that is not: the level that is
 * asked for, and the nearest. A single one is the seam at the end of a recording. */
int ggn_setting_levels_differ(const struct ggn_policy *policy, const double *spp, int n_levels, double *asked,
                              double *nearest);

#endif
