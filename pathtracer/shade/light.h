/*
 * Lights, as the kernel uses them:
 *
 * - selection of one of many;
 * - sampling of a direction towards it;
 * - emission that a path meets by chance;
 * - the densities of both, for multiple importance sampling: per solid angle at the reference point, with the probability
 *   of the selection.
 *
 * Pure, thread-safe, no allocation.
 *
 * A constant environment without a portal is never selected: sampling the BSDF or phase function is already the better
 * strategy for it.
 */
#ifndef PT_SHADE_LIGHT_H
#define PT_SHADE_LIGHT_H

#include "scene/scene.h"

/* Where light is gathered, and what is known of the cosine there: it may steer the selection, no more. */
enum pt_receiver_kind {
    PT_RECEIVER_SURFACE,    /* from the side of n only */
    PT_RECEIVER_BOTH_SIDES, /* from either side of n */
    PT_RECEIVER_VOLUME      /* from everywhere; n is 0 */
};
struct pt_receiver {
    pt_vec3 p;
    pt_vec3 n;    /* unit: that of the cosine in the reflection integral */
    int32_t kind; /* enum pt_receiver_kind */
};

struct pt_light_sample {
    pt_vec3 wi;          /* unit, from the reference point to the light */
    pt_vec3 radiance;    /* arriving along wi when nothing is in between; DELTA: irradiance on a facing surface */
    float inv_pdf_solid; /* 1 / density: kept so that the kernel need not divide; delta: 1 / probability of the selection */
    const float *pixel; /* environment image, else NULL: RGB still to be multiplied into `radiance`; read only when the light
                            turns out to be visible, because it is a cache miss as a rule */
    int delta;          /* no other strategy can find it */
    int finite;         /* `target` counts; else the light is at infinity along wi */
    pt_vec3 target;     /* point on the light, already moved off its surface towards the reference side */
    const struct pt_emitter *emitter; /* only with PT_FX_ALPHA or PT_FX_CONTACT: whose light it is */
};

/* The emitter that the hierarchy (light_tree.c) selects by u in [0, 1), and its probability; -1 when none of the node that
 * it reached can send light to `at`. */
int32_t pt_light_tree_pick(const struct pt_scene *scene, const struct pt_receiver *at, float u, float *pmf);

/* The probability with which pt_light_tree_pick selects `emitter`; 0 for one that is in no node. */
float pt_light_tree_pmf(const struct pt_scene *scene, const struct pt_receiver *at, int32_t emitter);

#endif
