/*
 * The three networks of the paper (denoiser R, feature map generator M, discriminator D) as graphs, for any width, window
 * and block size, in the published or the mended form.
 *
 * Source: Buisine, Teytaud, Delepoulle, Renaud, "Guided-Generative Network", Deep Learning Applications 4, Springer 2022.
 */
#ifndef GGN_MODEL_NETWORKS_H
#define GGN_MODEL_NETWORKS_H

#include "nn/graph.h"

enum ggn_preset {
    GGN_PRESET_PAPER, /* published: D's logit passes LeakyReLU and dropout */
    GGN_PRESET_LULL   /* mended: the logit is linear */
};
extern const char *const ggn_preset_names[]; /* "paper", "lull", NULL */

enum { GGN_NET_R, GGN_NET_M, GGN_NET_D, GGN_NETS };
enum { GGN_D_SCALARS = 1 };

#define GGN_REACH_MAX 4.0 /* octaves */

struct ggn_hyper {
    enum ggn_preset preset;
    int height, width; /* block, pixels; 16..1024 */
    int window;        /* images per window, S; 1..16 */
    int k_r, k_m, k_d; /* widths; 1..128, of D 1..64 */
    int noise_map;     /* 1: D also gets the noise map of the newest image; not in the published form */
    /* > 0: D's answer corrects the law of visible noise by up to so many octaves of noise (sight/measure.h); its last layer
     * starts at zero, where it is the law. 0: the answer is D's alone, as published */
    double reach;
    int scalars; /* 0, or GGN_SCALARS: numbers that D's linear layers also read; with reach */
};

/* The paper's sizes: 200×200, S = 6, K = 16, 20, 64. */
struct ggn_hyper ggn_hyper_default(enum ggn_preset preset);
/* BASE_EINVAL naming the field that is out of range. */
int ggn_hyper_check(const struct ggn_hyper *hyper, struct base_err *err);

/* R: 3×H×W → 3×H×W (sigmoid). M: 3S×H×W → 1×H×W (sigmoid). D: 2×H×W → logit (flat, 1); with `noise_map` 4×H×W: behind the
 * two maps GGN_NOISE_MAP_GAIN · the noise map (model/window.h; with `reach` the map of visible noise), and 1 everywhere;
 * without half buffers 0 in both. With `scalars` value GGN_D_SCALARS of its graph takes them. */
int ggn_network_build(struct ggn_graph *graph, int net, const struct ggn_hyper *hyper, struct base_err *err);

#endif
