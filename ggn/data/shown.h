/*
 * The pictures that people are shown in a study: chooses blocks and levels, and writes every picture as a lossless PNG,
 * DIR/vVIEW/NAME.png, of a block bID-WHAT.png.
 *
 * A view is a folder. With a manifest.json it is a recorded sequence: its levels, and where a block has independent halves
 * also simulated ones up to SEQ_STUDY_CAP (data/stimuli.h). Without one it holds pictures of one size: `reference.png`
 * (or any extension that is read), and for thresholds one picture per level whose name ends in its samples per pixel
 * (`view-00256.png`), for a validation one picture per condition, named like it. Renders with --denoise give a view of each
 * kind that is asked for. Folders of frames in the place of pictures, reference/0001.exr …, 256/0001.exr …, are a clip: in
 * DIR the frames of a block lie below each other in one picture, which is fetched and decoded whole before it is shown.
 */
#ifndef GGN_DATA_SHOWN_H
#define GGN_DATA_SHOWN_H

#include "base/threads.h"

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
extern const char *const ggn_shown_kind_names[GGN_SHOWN_KINDS + 1]; /* "", "noisy", "denoised", "blend", NULL */

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
    /* FOLDER, or FOLDER:BLOCKS with blocks like 0,3,8-11: what follows the last colon, if it looks like a list. A view's
     * name is the folder's, with .KIND. */
    const char *const *views;
    int n_views;
    enum ggn_shown_kind kinds[GGN_SHOWN_KINDS];
    int n_kinds;               /* 0: the pictures as they are */
    int block;                 /* pixels, for folders of pictures */
    double spacing;            /* octaves: nearer levels are left out */
    uint32_t spp_min, spp_max; /* levels outside are left out */
};

/* shown: zeroed; released by the caller, also after a failure, when some of the pictures may be there. */
int ggn_shown_make(const struct ggn_shown_request *request, struct ggn_shown *shown, struct base_threads *threads,
                   struct base_err *err);
void ggn_shown_release(struct ggn_shown *shown);

#endif
