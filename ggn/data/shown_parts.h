/* What makes the views of data/shown.h that are folders of pictures, and what it shares with that of sequences. */
#ifndef GGN_DATA_SHOWN_PARTS_H
#define GGN_DATA_SHOWN_PARTS_H

#include "data/shown.h"

struct ggn_shown_source { /* where a view comes from */
    char folder[4096];
    const char *blocks; /* borrows from the text; NULL: all */
};

/* Makes the view that is the index-th of those that are shown, from the source: its blocks, levels and files. Of a
 * validation the first view also says which conditions there are. */
int ggn_shown_pictures(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct ggn_shown *shown, struct base_err *err);

/* Letters, digits, '.', '_', '-', not starting with '.': what may stand in a file name or an address. */
int ggn_shown_plain_name(const char *name);
/* Whether the block is among those of the source. */
int ggn_shown_source_has(const struct ggn_shown_source *source, uint32_t id);
/* BASE_EINVAL: the source names a block that the view does not have. */
int ggn_shown_source_check(const struct ggn_shown_source *source, const struct ggn_shown_view *view, struct base_err *err);

/* Whether a level of so many samples is taken after those that the block has. */
int ggn_shown_takes_level(const struct ggn_shown_request *q, const struct ggn_shown_block *b, double spp);
/* BASE_EINVAL: too few for a threshold. `folder` is for the message. */
int ggn_shown_enough_levels(const char *folder, const struct ggn_shown_block *b, struct base_err *err);

/* Writes a picture of view number `view`: rgb [height][width][3], those of a clip's frames below each other. b: the block
 * that it shows, NULL: the whole view. what NULL: it is what others are compared with, "reference", and beside it comes what
 * catch trials show, "heavy". Thread-safe for different pictures. */
int ggn_shown_write(const struct ggn_shown_request *q, int view, const struct ggn_shown_block *b, const char *what,
                    int width, int height, const uint8_t *rgb, struct base_err *err);

#endif
