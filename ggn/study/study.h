/*
 * The definition of one study: what is shown, how often, and what counts. DIR/study.json; its form is ggn/study/FORMAT.md.
 *
 * A study is written once by `lull-study init` and read by everything else. Beside it lie DIR/texts.json (what the page
 * says), DIR/stimuli (lossless pictures) and DIR/study.db (people and trials, ggn/study/store.h). Immutable after reading,
 * so any number of threads may read one object.
 */
#ifndef GGN_STUDY_STUDY_H
#define GGN_STUDY_STUDY_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

enum {
    GGN_STUDY_NAME = 96,  /* bytes of a name, the NUL included */
    GGN_STUDY_LINE = 200, /* bytes of who asks and of their address, the NUL included */
    GGN_STUDY_MAX_VIEWS = 1024,
    GGN_STUDY_MAX_BLOCKS = 4096, /* of one view */
    GGN_STUDY_MAX_LEVELS = 1024, /* of one block */
    GGN_STUDY_MAX_CONDITIONS = 64,
    GGN_STUDY_MAX_TRIALS = 200000, /* of one person */
    GGN_STUDY_MAX_FRAMES = 60,     /* of a clip */
    GGN_STUDY_MAX_SHOWN = 60,      /* frames in an interval, repeated loops counted */
    GGN_STUDY_MAX_FPS = 120,
    GGN_STUDY_MAX_STAND = 9999 /* ms that a frame of a clip stood; the page says no more */
};

enum ggn_study_task {
    GGN_STUDY_ADJUSTMENT,   /* whole picture: the samples of the block under the pointer are set until it looks the same */
    GGN_STUDY_TWO_INTERVAL, /* one block: which of two intervals has the noise; QUEST+ chooses the samples */
    GGN_STUDY_VALIDATION    /* whole picture against its reference: same or different, and how disturbing */
};

enum ggn_study_kind { /* what of a render with --denoise a view shows */
                      GGN_STUDY_AS_IS,
                      GGN_STUDY_NOISY,
                      GGN_STUDY_DENOISED,
                      GGN_STUDY_BLEND,
                      GGN_STUDY_KINDS
};

struct ggn_study_block {
    uint32_t id, x0, y0, x1, y1; /* pixels; x1, y1 exclusive */
    int n_levels;
    uint32_t *levels; /* owns; samples per pixel, strictly rising */
};

struct ggn_study_view {
    char name[GGN_STUDY_NAME];      /* with a kind SCENE.KIND: no reader of thresholds takes one kind for another */
    enum ggn_study_kind kind;       /* thresholds in two intervals only */
    uint32_t width, height;         /* pixels */
    int frames;                     /* 1: stills; more: clips, two intervals only */
    int n_blocks;                   /* 0 in a validation */
    struct ggn_study_block *blocks; /* owns; ids strictly rising */
};

struct ggn_study {
    char id[33]; /* 32 hex digits, made at init: trials are imported into their own study only */
    enum ggn_study_task task;
    uint64_t seed; /* below 2^53, so that JSON keeps it: the order of every person follows from it and from their number */
    int trials;    /* per block, catch trials included (two-interval) */
    int repeats;   /* settings per block (adjustment), judgements per picture (validation) */
    double catch_share;
    int show_ms, gap_ms;                                    /* two-interval: each interval, and the blank between them */
    int fps;                                                /* of clips, frames a second; 0: there are none */
    int break_every;                                        /* trials between offered breaks; 0: none */
    double min_catch_passed, max_untouched;                 /* exclusion rules, shares: see FORMAT.md */
    double min_ms;                                          /* an answer in less time is left out: too fast to have looked */
    double max_fast;                                        /* a person of whose answers a larger share is does not count */
    char asked_by[GGN_STUDY_LINE], contact[GGN_STUDY_LINE]; /* UTF-8, who asks and where; empty in old studies */
    int n_views;
    struct ggn_study_view *views;       /* owns */
    int n_conditions;                   /* validation; each view has a picture of each */
    char (*conditions)[GGN_STUDY_NAME]; /* owns */
};

extern const char *const ggn_study_task_names[3];               /* "adjustment", "2ifc", "validation" */
extern const char *const ggn_study_kind_names[GGN_STUDY_KINDS]; /* "", "noisy", "denoised", "blend" */
extern const double ggn_study_min_ms[3]; /* of each task, for new studies: the reasons are in docs/study.md */

/* Reads and checks DIR/study.json. */
int ggn_study_read(const char *dir, struct ggn_study *study, struct base_err *err);
int ggn_study_parse(const char *path, const char *text, size_t size, struct ggn_study *study, struct base_err *err);
/* Writes DIR/study.json atomically. */
int ggn_study_write(const char *dir, const struct ggn_study *study, struct base_err *err);
/* BASE_EINVAL when writing `output` would replace a file of the study in DIR, by whatever name, or take the name of one that
 * is made later. Reports and exports may lie beside them. */
int ggn_study_protect(const char *dir, const char *output, struct base_err *err);
/* The same as text (malloc, caller frees); NULL when out of memory. */
char *ggn_study_print(const struct ggn_study *study);
void ggn_study_release(struct ggn_study *study);

/* Letters, digits, '.', '_', '-', not starting with '.': what may stand in a file name or an address. */
int ggn_study_plain_name(const char *name);
/* One line of 1 … GGN_STUDY_LINE - 1 bytes that is not blank. */
int ggn_study_plain_line(const char *text);
/* Index of a level in the block, or -1. */
int ggn_study_level(const struct ggn_study_block *block, uint32_t spp);
/* How many frames of a clip an interval shows, those of repeated loops counted; 0 without clips. */
int ggn_study_shown_frames(const struct ggn_study *study);
/* Fills in show_ms and fps where they are 0: 700 ms of stills, two loops of clips at 24 frames a second. BASE_EINVAL: fps
 * without a clip, clips in another task, an interval shorter than a loop or of more than GGN_STUDY_MAX_SHOWN frames. */
int ggn_study_fit_intervals(struct ggn_study *study, struct base_err *err);
/* Whether two views show the same pictures, but for their kind. */
int ggn_study_same_scene(const struct ggn_study_view *a, const struct ggn_study_view *b);
/* Index of a view by name, or -1. */
int ggn_study_find_view(const struct ggn_study *study, const char *name);

#endif
