/*
 * The pictures that a study shows, on disk. Sequences and folders of pictures are written through here. Thread-safe for
 * different pictures.
 */
#ifndef GGN_DATA_SHOWN_FILES_H
#define GGN_DATA_SHOWN_FILES_H

#include <stddef.h>

#include "base/err.h"
#include "data/shown_view.h"

int ggn_shown_write(const char *dir, int view, const char *name, int width, int height, const uint8_t *rgb,
                    struct base_err *err);
/* rgb: the block's pixels, 3 codes each, those of a clip's frames below each other. */
int ggn_shown_write_block(const char *dir, int view, const struct ggn_shown_block *b, const char *what, int frames,
                          const uint8_t *rgb, struct base_err *err);
/* What a block is compared with, and what its catch trials show. */
int ggn_shown_write_reference(const char *dir, int view, const struct ggn_shown_block *b, int frames, const uint8_t *rgb,
                              struct base_err *err);
/* *out: a copy of rgb[n] (malloc, caller frees) with noise that nobody misses, for catch trials. */
int ggn_shown_make_heavy(const uint8_t *rgb, size_t n, uint8_t **out, struct base_err *err);

/* Whether a level of so many samples is taken after those that the block has. */
int ggn_shown_takes_level(const struct ggn_shown_request *q, const struct ggn_shown_block *b, double spp);
/* BASE_EINVAL: too few for a threshold. `folder` is for the message. */
int ggn_shown_enough_levels(const char *folder, const struct ggn_shown_block *b, struct base_err *err);

#endif
