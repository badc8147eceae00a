/*
 * When a block stops: the one rule, for the criterion in a renderer and for everything that replays recorded levels.
 *
 * Whoever watches a block asks about its sample counts as they come. If the image belongs into the window, it is added to
 * the window and judged by what it shows, which is computed only as far as the rule needs it:
 *
 * - The first image and those after it, until a window is full, are too early for the network.
 * - Then the network: p = ggn_policy_p(logit). `passes` checks in a row with p below the threshold stop the block.
 *
 * A residual model has `reach` > 0. Its logit is that of the law of visible noise, log2 of the newest image's error, and the
 * network's correction of up to `reach`. Then every look is judged: by the law alone until a window is full and where the
 * network could not change the verdict, between the window's images with the last correction. The next look is where the
 * law expects the end, at the next image at the latest.
 *
 * Nothing here looks at pixels or keeps more than the plain values below. Pure functions, any thread.
 */
#ifndef GGN_MODEL_STOPPER_H
#define GGN_MODEL_STOPPER_H

#include <stdint.h>

#include "model/policy.h"

enum { GGN_WINDOW_MAX = 16 };

struct ggn_stop_rule {
    struct ggn_policy policy;
    int window;   /* images per window, S; 1 .. GGN_WINDOW_MAX */
    double reach; /* octaves of noise; 0: the network answers alone */
};

struct ggn_verdict {
    uint32_t stop;
    uint32_t too_early;
    uint64_t next_spp;    /* samples at which to ask again, where it goes on */
    double p;             /* probability that the noise is still seen; NaN: the network was not asked */
    double predicted_spp; /* where it expects to stop; NaN: not known */
    double noise;         /* with `reach` the law's error; NaN: not known */
};

/* One block. All zero: never asked. */
struct ggn_stopper {
    uint64_t asked_spp;
    uint64_t spp[GGN_WINDOW_MAX]; /* of the window's images, oldest first */
    uint32_t used;                /* images in the window */
    uint32_t passes;              /* checks in a row below the threshold */
    struct ggn_verdict verdict;   /* the last one */
    double correction;            /* with `reach`: the network's last one, octaves of noise */
};

/* What the window shows whose newest image is the one asked about. */
struct ggn_evidence {
    void *data;
    double (*logit)(void *data); /* the network's, of a full window */
    double (*law)(void *data);   /* with `reach`: log2 of the error of the image asked about; NaN: not known */
};

/* What an image asked about is. */
enum { GGN_LOOK_NONE, GGN_LOOK_IMAGE, GGN_LOOK_BETWEEN };

/* The block now has `spp` samples. GGN_LOOK_IMAGE: its image is the newest of the window (the oldest leaves when there are
 * more than rule->window), to be judged next. GGN_LOOK_BETWEEN, with `reach`: no image of the window, but to be judged, too.
 * GGN_LOOK_NONE: the verdict stands: the same question again, before the first level, or so soon after
 * the newest image that the two would hardly differ. */
int ggn_stopper_ask(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp);
/* Sets s->verdict on the image that ggn_stopper_ask has just accepted. */
void ggn_stopper_decide(const struct ggn_stop_rule *rule, struct ggn_stopper *s, const struct ggn_evidence *evidence);

/* The end of the rule, also of those criteria that have a score and a cut and no network: counts a check. 1: so many checks
 * in a row were below; the block stops. */
int ggn_stopper_pass(struct ggn_stopper *s, int passes, int below);

/* Whether a stopper from a file can be that of this rule. */
int ggn_stopper_valid(const struct ggn_stop_rule *rule, const struct ggn_stopper *s);

#endif
