/* Where a view comes from, as the command line says it: FOLDER, or FOLDER:BLOCKS with blocks like 0,3,8-11. */
#ifndef GGN_DATA_SHOWN_SOURCE_H
#define GGN_DATA_SHOWN_SOURCE_H

#include "base/err.h"
#include "data/shown_view.h"

struct ggn_shown_source {
    char folder[4096];
    const char *blocks; /* borrows from the text; NULL: all */
};

/* BASE_EINVAL: the folder's name is too long. What follows the last colon is a list if it looks like one. */
int ggn_shown_source_parse(const char *text, struct ggn_shown_source *source, struct base_err *err);
/* Whether the block is among those of the source. */
int ggn_shown_source_has(const struct ggn_shown_source *source, uint32_t id);
/* BASE_EINVAL: the source names a block that the view does not have. */
int ggn_shown_source_check(const struct ggn_shown_source *source, const struct ggn_shown_view *view, struct base_err *err);

/* These make the view that is the index-th of those that are shown, from the source: its blocks, levels and files. */
struct base_threads;
int ggn_shown_sequence(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct ggn_shown_view *view, struct base_threads *threads, struct base_err *err);
/* Of a validation the first view also says which conditions there are. */
int ggn_shown_pictures(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct ggn_shown *shown, struct base_err *err);

#endif
