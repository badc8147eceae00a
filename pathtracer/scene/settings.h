/*
 * How paths are drawn: what the scene file says of it, as the command line overrides it. Plain data, read-only while
 * rendering. Each list below gives an enumeration and the words that the command line and manifests use for it.
 */
#ifndef PT_SCENE_SETTINGS_H
#define PT_SCENE_SETTINGS_H

#include <stdint.h>

/* X(ID, word) */
#define PT_SAMPLERS(X) X(INDEPENDENT, "independent") X(SOBOL, "sobol")
#define PT_STRATEGIES(X) \
    X(MIS, "path")            /* next-event estimation and BSDF sampling, power heuristic */ \
    X(BSDF_ONLY, "bsdf-only") /* brute force: emission is met by BSDF sampling only; the oracle of tests */
#define PT_LIGHT_SELECTIONS(X) \
    X(HIERARCHY, "hierarchy") /* by distance, orientation and cosine too, where that is worth its time; else by power */ \
    X(POWER, "power")
#define PT_FILTERS(X) X(BOX, "box") X(TRIANGLE, "triangle") X(GAUSSIAN, "gaussian")

#define PT_SAMPLER_ID(id, word) PT_SAMPLER_##id,
enum pt_sampler_kind { PT_SAMPLERS(PT_SAMPLER_ID) };
#define PT_STRATEGY_ID(id, word) PT_STRATEGY_##id,
enum pt_strategy { PT_STRATEGIES(PT_STRATEGY_ID) };
#define PT_LIGHT_SELECTION_ID(id, word) PT_LIGHT_SELECTION_##id,
enum pt_light_selection { PT_LIGHT_SELECTIONS(PT_LIGHT_SELECTION_ID) };
#define PT_FILTER_ID(id, word) PT_FILTER_##id,
enum pt_filter_kind { PT_FILTERS(PT_FILTER_ID) };

/* The words by the enumerations above, NULL after the last; and all of them as one text, "|box|triangle|gaussian". */
extern const char *const pt_sampler_words[], *const pt_strategy_words[], *const pt_light_selection_words[],
                                                                             *const pt_filter_words[];
#define PT_WORD_OR(id, word) "|" word

struct pt_integrator {
    int32_t max_depth;        /* most surface/medium bounces; < 0 = unlimited */
    int32_t rr_depth;         /* Russian roulette from this bounce on */
    int32_t sampler;          /* enum pt_sampler_kind */
    int32_t strategy;         /* enum pt_strategy */
    int32_t filter;           /* enum pt_filter_kind: sampled by importance, so no sample touches a neighbouring pixel */
    float filter_x, filter_y; /* radii in pixels; 0.5 = box of one pixel */
    float filter_sigma;       /* Gaussian only, pixels */
    float max_component;      /* radiance clamp of one sample (pbrt maxcomponentvalue); INFINITY = none */
    uint32_t seed;
    int32_t want_aux; /* fill albedo, normal_world, depth */
};

#endif
