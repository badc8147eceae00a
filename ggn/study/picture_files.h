/*
 * The pictures that a study shows, on disk: DIR/stimuli/vVIEW/NAME.png, of a block bID-WHAT.png. Sequences and folders of
 * pictures are written through here. Thread-safe for different pictures.
 */
#ifndef GGN_STUDY_PICTURE_FILES_H
#define GGN_STUDY_PICTURE_FILES_H

#include "study/prepare.h"

/* path has room for 4096 bytes. */
int ggn_study_picture_path(char *path, const char *dir, int view, const char *name, struct base_err *err);
/* rgb: the block's pixels, 3 codes each, those of a clip's frames below each other. */
int ggn_study_write_block(const char *dir, int view, const struct ggn_study_block *b, const char *what, int frames,
                          const uint8_t *rgb, struct base_err *err);
/* What a block is compared with, and what its catch trials show. */
int ggn_study_write_reference(const char *dir, int view, const struct ggn_study_block *b, int frames, const uint8_t *rgb,
                              struct base_err *err);
/* *out: a copy of rgb[n] (malloc, caller frees) with noise that nobody misses, for catch trials. */
int ggn_study_make_heavy(const uint8_t *rgb, size_t n, uint8_t **out, struct base_err *err);

/* Whether a level of so many samples is taken after those that the block has. */
int ggn_study_takes_level(const struct ggn_study_request_views *q, const struct ggn_study_block *b, double spp);
/* BASE_EINVAL: too few for a threshold. `folder` is for the message. */
int ggn_study_enough_levels(const char *folder, const struct ggn_study_block *b, struct base_err *err);

#endif
