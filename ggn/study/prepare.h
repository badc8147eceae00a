/*
 * Makes a study: chooses blocks and levels, writes every picture it shows as a lossless PNG, then texts.json and study.json.
 *
 * A view is a folder. With a manifest.json it is a recorded sequence: its levels, and where a block has independent halves
 * also simulated ones up to GGN_SIMULATED_CAP (study/stimuli.h). Without one it holds pictures of one size: `reference.png`
 * (or any extension that is read), and for thresholds one picture per level whose name ends in its samples per pixel
 * (`view-00256.png`), for a validation one picture per condition, named like it. Renders with --denoise give a view of each
 * kind that is asked for. Folders of frames in the place of pictures, reference/0001.exr …, 256/0001.exr …, are a clip: in
 * DIR the frames of a block lie below each other in one picture, which is fetched and decoded whole before it is shown.
 */
#ifndef GGN_STUDY_PREPARE_H
#define GGN_STUDY_PREPARE_H

#include "base/threads.h"
#include "study/study.h"

struct ggn_study_request_views { /* what `lull-study init` was told; all borrowed */
    const char *dir;             /* to be made; must not hold a study */
    const char *page_dir;        /* its texts.en.json becomes DIR/texts.json */
    const char *const *views;    /* FOLDER or FOLDER:BLOCKS (study/source.h); a view's name is the folder's, with .KIND */
    int n_views;
    enum ggn_study_kind kinds[GGN_STUDY_KINDS];
    int n_kinds;               /* 0: the pictures as they are */
    int block;                 /* pixels, for folders of pictures */
    double spacing;            /* octaves: nearer levels are left out */
    uint32_t spp_min, spp_max; /* levels outside are left out */
};

/* study: the numbers are given, id, views and conditions are filled in (released by the caller). Nothing is left in DIR that
 * looks like a study unless all went well: study.json is written last. */
int ggn_study_prepare(const struct ggn_study_request_views *request, struct ggn_study *study, struct base_threads *threads,
                      struct base_err *err);

#endif
