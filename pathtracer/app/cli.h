/* The command line of `lull-render`, parsed and checked as far as it can be without the scene. */
#ifndef PT_CLI_H
#define PT_CLI_H

#include <lull/criterion.h>

#include <stdint.h>

#include "base/err.h"
#include "base/outputs.h"
#include "pbrt/load_options.h"

enum { PT_CLI_MAX_PARAMS = 64, PT_CLI_MAX_STOP_MAPS = 4, PT_CLI_SCENES_DEPTH = -2, PT_CLI_MAX_PIXELS = 1 << 28 };

enum pt_cli_action { PT_CLI_RENDER, PT_CLI_LIST_CRITERIA, PT_CLI_EXPLAIN, PT_CLI_DEBUG_PATH, PT_CLI_SEQUENCE, PT_CLI_QUOTE };

/* Text is borrowed from argv, except for the keys of params. Integers that may be absent are -1 then. */
struct pt_cli {
    int action;        /* enum pt_cli_action */
    const char *scene; /* path; NULL only when criteria are listed */
    int block_width, block_height;
    uint64_t spp_min, spp_max; /* 0 with list-criteria only */
    uint64_t spp;              /* uniform; 0 = not given */
    double time_budget_s, max_check_overhead, max_seam;
    int width, height; /* 0 = the scene's */
    int crop[4], has_crop;
    struct pt_view view;   /* instead of the scene's camera */
    const char *criterion; /* NULL = not given */
    struct lull_pair params[PT_CLI_MAX_PARAMS];
    char *param_text[PT_CLI_MAX_PARAMS]; /* owns; what the keys and values point into */
    uint32_t param_count;
    const char *mask;      /* picture that scales the dial per block; NULL = none */
    int threads;           /* 0 = all processors */
    double rank_timeout_s; /* wait for an answer of another process */
    uint32_t seed;
    const char *output, *preview, *report;
    struct base_outputs outputs; /* all files to be written that the command line names */
    const char *stop_maps[PT_CLI_MAX_STOP_MAPS];
    int stop_map_count;
    const char *checkpoint;
    double checkpoint_every_s;
    int resume;
    int quote;
    uint64_t pilot_spp; /* 0 without quote */
    double pilot_s;
    const char *quote_map;
    int json;
    int debug[3]; /* x, y, sample of --debug-path */
    int all_effects, strict, quiet, reproducible;
    int light_selection;           /* enum pt_light_selection */
    int sampler, strategy, filter; /* enums of scene/settings.h; -1 = the scene's */
    double filter_radius;          /* <= 0: the usual one of the filter */
    int max_depth;                 /* -1 = unlimited, PT_CLI_SCENES_DEPTH */
    uint32_t aov;                  /* PT_FILM_* */
    uint32_t order_seed;           /* hidden: hand out work in a shuffled order */
    const char *sequence;          /* folder */
    const char *levels;
    const char *sequence_blocks; /* "0,3,5-8" or NULL */
    uint64_t reference_spp;
    const char *name; /* of the scene in the manifest, "SCENE" or "SCENE/VIEW" */
};

/* Fills *cli (zeroed first). --help, --version and --usage print and exit. BASE_EINVAL with one line in err otherwise. */
int pt_cli_parse(struct pt_cli *cli, int argc, char **argv, struct base_err *err);
void pt_cli_release(struct pt_cli *cli);

#endif
