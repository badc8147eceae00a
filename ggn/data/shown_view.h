/* What people are shown: views, their blocks and levels; and what makes it of which folders. */
#ifndef GGN_DATA_SHOWN_VIEW_H
#define GGN_DATA_SHOWN_VIEW_H

#include <stdint.h>

enum {
    GGN_SHOWN_NAME = 96, /* bytes of a name, the NUL included */
    GGN_SHOWN_MAX_VIEWS = 1024,
    GGN_SHOWN_MAX_BLOCKS = 4096, /* of one view */
    GGN_SHOWN_MAX_LEVELS = 1024, /* of one block */
    GGN_SHOWN_MAX_CONDITIONS = 64,
    GGN_SHOWN_MAX_FRAMES = 60 /* of a clip */
};

enum ggn_shown_task { GGN_SHOWN_ADJUSTMENT, GGN_SHOWN_TWO_INTERVAL, GGN_SHOWN_VALIDATION };

enum ggn_shown_kind { /* what of a render with --denoise a view shows */
                      GGN_SHOWN_AS_IS,
                      GGN_SHOWN_NOISY,
                      GGN_SHOWN_DENOISED,
                      GGN_SHOWN_BLEND,
                      GGN_SHOWN_KINDS
};

struct ggn_shown_block {
    uint32_t id, x0, y0, x1, y1; /* pixels; x1, y1 exclusive */
    int n_levels;
    uint32_t *levels; /* owns; samples per pixel, strictly rising */
};

struct ggn_shown_view {
    char name[GGN_SHOWN_NAME];      /* with a kind SCENE.KIND: no reader of thresholds takes one kind for another */
    enum ggn_shown_kind kind;       /* two intervals only */
    uint32_t width, height;         /* pixels */
    int frames;                     /* 1: stills; more: clips, two intervals only */
    int n_blocks;                   /* 0 in a validation */
    struct ggn_shown_block *blocks; /* owns; ids strictly rising */
};

struct ggn_shown {
    int n_views;
    struct ggn_shown_view *views;       /* owns */
    int n_conditions;                   /* validation; each view has a picture of each */
    char (*conditions)[GGN_SHOWN_NAME]; /* owns */
};

struct ggn_shown_request { /* all borrowed */
    const char *dir;       /* where the folders of the views are made */
    enum ggn_shown_task task;
    const char *const *views; /* FOLDER or FOLDER:BLOCKS (shown_source.h); a view's name is the folder's, with .KIND */
    int n_views;
    enum ggn_shown_kind kinds[GGN_SHOWN_KINDS];
    int n_kinds;               /* 0: the pictures as they are */
    int block;                 /* pixels, for folders of pictures */
    double spacing;            /* octaves: nearer levels are left out */
    uint32_t spp_min, spp_max; /* levels outside are left out */
};

extern const char *const ggn_shown_kind_names[GGN_SHOWN_KINDS + 1]; /* "", "noisy", "denoised", "blend", NULL */

void ggn_shown_release(struct ggn_shown *shown);
/* Letters, digits, '.', '_', '-', not starting with '.': what may stand in a file name or an address. */
int ggn_shown_plain_name(const char *name);

#endif
