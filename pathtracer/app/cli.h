/* The command line of `lull-render`, parsed and checked as far as it can be without the scene. */
#ifndef PT_CLI_H
#define PT_CLI_H

#include <stdint.h>

#include "base/err.h"
#include "base/options.h"
#include "base/paths.h"
#include "pbrt/load.h"
#include "render/output.h"
#include "render/render.h"
#include "render/sequence.h"

enum { PT_CLI_MAX_PARAMS = 64, PT_CLI_MAX_STOP_MAPS = 4, PT_CLI_SCENES_DEPTH = -2, PT_CLI_MAX_PIXELS = 1 << 28 };

enum pt_cli_action { PT_CLI_RENDER, PT_CLI_LIST_CRITERIA, PT_CLI_EXPLAIN, PT_CLI_DEBUG_PATH, PT_CLI_SEQUENCE, PT_CLI_QUOTE };

/* -p, and what else becomes a parameter of the criterion. */
struct pt_cli_params {
    struct lull_pair list[PT_CLI_MAX_PARAMS];
    char *text[PT_CLI_MAX_PARAMS]; /* owns; what the keys and values point into */
    uint32_t count;
};

/* Files of a frame: what it is made from and to. */
enum pt_path {
    PT_SCENE,
    PT_OUTPUT,
    PT_PREVIEW,
    PT_REPORT,
    PT_PAGE,
    PT_QUOTED, /* what was quoted for it, to be compared with on the page */
    PT_CHECKPOINT,
    PT_STOP_MAPS, /* the first; those that there are come first */
    PT_PATHS = PT_STOP_MAPS + PT_CLI_MAX_STOP_MAPS
};

/* Frames that belong together (frame.h). */
struct pt_shot_plan {
    const char *frames, *camera_path; /* list; file; one of them: a shot */
    const char *plan, *table;         /* --plan-shot, --shot-table */
    int plan_every, same_seed;
};

/* Text is borrowed from argv. Each part is what one piece of the program takes. */
struct pt_cli {
    int action;                  /* enum pt_cli_action */
    const char *paths[PT_PATHS]; /* NULL: not given; of a shot with a place for the frame's number */
    int stop_maps;               /* how many of them there are */
    struct pt_load_options load;
    /* Size and crop are the scene's unless has_crop, and in its integrator what is -1 (max_depth: PT_CLI_SCENES_DEPTH). */
    struct pt_render_config render;
    int has_crop;
    const char *criterion; /* NULL = not given */
    struct pt_cli_params params;
    enum pt_picture picture;     /* that is kept */
    const char *mask;            /* picture that scales the quality parameter per block; NULL = none */
    int threads;                 /* 0 = all processors */
    double rank_timeout_s;       /* wait for an answer of another process */
    struct base_outputs outputs; /* all files to be written that the command line names */
    int reproducible;            /* leave times out of the EXR */
    int live;                    /* stop maps and report are written while rendering, too */
    double checkpoint_every_s;
    int resume;
    struct pt_sequence_config sequence; /* directory NULL: none */
    const char *display;                /* address of a viewer; NULL: none */
    struct pt_shot_plan shot;
    const char *quote_map;
    int quote, json;
    int debug[3];      /* x, y, sample of --debug-path */
    char *const *argv; /* borrows; [argc], options first */
    int argc;
    int all_effects, quiet, no_progress;
    uint64_t spp; /* the same everywhere, 0 = not given; render.spp_min and spp_max are it, then */
};

/* Fills *cli (zeroed first). --help, --version and --usage print and exit. BASE_EINVAL with one line in err otherwise. */
int pt_cli_parse(struct pt_cli *cli, int argc, char **argv, struct base_err *err);
/* The part of it that compares options with each other (cli_check.c). */
int pt_cli_check(struct pt_cli *cli, struct base_err *err);
void pt_cli_release(struct pt_cli *cli);

/* The table of the options: roles and lines of the identity, too, of a command line in which the scene's own settings stand
 * where it says nothing. */
extern const struct base_option pt_cli_options[];

/* It is about the frames of a shot. */
int pt_cli_is_shot(const struct pt_cli *cli);
/* Nine numbers, as for --look-at. BASE_EINVAL says what was expected. */
int pt_cli_look_at(const char *text, struct pt_view *view, struct base_err *err);
/* It draws samples: an image, a quote or a recording, in which other processes can help. */
int pt_cli_samples(const struct pt_cli *cli);
/* It names a file that an image is written to. */
int pt_cli_writes_image(const struct pt_cli *cli);

#endif
