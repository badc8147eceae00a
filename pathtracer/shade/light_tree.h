/*
 * Selection of an emitter by what it probably sends to a point: a walk down the hierarchy of pt_light_tree, at each node to
 * a child in proportion to its importance (Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive
 * Tree Splitting"). Lights at infinity stand beside the hierarchy. Pure, thread-safe, no allocation.
 */
#ifndef PT_SHADE_LIGHT_TREE_H
#define PT_SHADE_LIGHT_TREE_H

#include "shade/light.h"

/* The emitter selected by u in [0, 1) and its probability, -1 when none of the node reached can send light to `at`. */
int32_t pt_light_tree_pick(const struct pt_scene *scene, const struct pt_receiver *at, float u, float *pmf);

/* The probability with which pt_light_tree_pick selects `emitter`; 0 for one that is in no node. */
float pt_light_tree_pmf(const struct pt_scene *scene, const struct pt_receiver *at, int32_t emitter);

#endif
