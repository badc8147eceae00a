/*
 * Records a view (plugin-api/sequence/FORMAT.md), in one of two ways; running again goes on and refuses a folder that was
 * begun with other settings.
 *
 * Blocks alone (version 1): block after block, each at rising sample counts, with a reference of independent samples. A
 * finished block is one file plus its line in the manifest.
 *
 * Whole frames (version 2, recorder.c): all blocks at once, in step or each at the looks of its criterion, with what that is
 * shown and what it answers. A look is one file; the film in between is a checkpoint in the folder.
 */
#ifndef PT_RENDER_SEQUENCE_H
#define PT_RENDER_SEQUENCE_H

#include "base/err.h"
#include "render/render.h"
#include "pbrt/load.h"

enum { PT_SEQUENCE_MAX_LEVELS = 4000 };

struct pt_sequence_config {
    const char *directory;         /* made when it is not there */
    const char *levels;            /* "geometric:20:10000:1.15", "linear:20:10000:20"; NULL = the first of these */
    const char *blocks;            /* "0,3,5-8"; NULL = all */
    const char *name;              /* "SCENE" or "SCENE/VIEW"; NULL = by the scene file's name */
    struct pt_view view;           /* that replaced the scene's camera */
    uint64_t reference_spp;        /* 0 = no reference */
    uint32_t planes;               /* of whole frames, bits 1 << SEQ_PLANE_…; 0: blocks alone */
    int past_stops;                /* of whole frames: stopped blocks go on to the most samples */
    const char *criterion;         /* as it was named; NULL: nobody is asked */
    const struct lull_pair *pairs; /* its parameters, [pair_count] */
    uint32_t pair_count;
    const char *scene_path;
    uint32_t scene_crc, inputs_crc; /* of the scene file; of every file that was read */
    struct pt_render_config render; /* size, block, integrator; the rest is set here */
};

/* Parses levels into spp[]; returns their number or BASE_EINVAL. */
int pt_sequence_levels(const char *text, uint32_t spp[PT_SEQUENCE_MAX_LEVELS], struct base_err *err);
/* Marks the listed ids in chosen[0 … count). */
int pt_sequence_choose(const char *text, uint8_t *chosen, uint32_t count, struct base_err *err);

/* criterion may be NULL; else its `error` is recorded at every level. *was_interrupted is set when
 * *hooks->interrupted was: the block being recorded is lost, all before it are safe. Of the hooks slice, interrupted
 * and log are used; a note is made of each block. */
int pt_sequence_record(const struct pt_sequence_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                       struct base_threads *threads, struct lull_host_criterion *criterion,
                       const struct pt_render_hooks *hooks, int *was_interrupted, struct base_err *err);

/* The same of a whole frame. Without levels the criterion is needed: its looks are recorded, and it stops blocks. */
int pt_sequence_record_frame(const struct pt_sequence_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                             struct base_threads *threads, struct lull_host_criterion *criterion,
                             const struct pt_render_hooks *hooks, int *was_interrupted, struct base_err *err);

/* What both ways share: the view in words; a folder that was begun with others, theirs, is refused by what differs. */
struct seq_manifest;
void pt_sequence_describe(const struct pt_sequence_config *config, const struct pt_scene *scene, struct seq_manifest *m);
int pt_sequence_same(const struct base_identity *ours, const struct base_identity *theirs, const char *path,
                     struct base_err *err);
/* The seed of reference `index`, from 0. */
uint32_t pt_sequence_reference_seed(uint32_t seed, int index);

#endif
