/* Where a view comes from, as the command line says it: FOLDER, or FOLDER:BLOCKS with blocks like 0,3,8-11. */
#ifndef GGN_STUDY_SOURCE_H
#define GGN_STUDY_SOURCE_H

#include "study/study.h"

struct ggn_study_source {
    char folder[4096];
    const char *blocks; /* borrows from the text; NULL: all */
};

/* BASE_EINVAL: the folder's name is too long. What follows the last colon is a list if it looks like one. */
int ggn_study_source_parse(const char *text, struct ggn_study_source *source, struct base_err *err);
/* Whether the block is among those of the source. */
int ggn_study_source_has(const struct ggn_study_source *source, uint32_t id);
/* BASE_EINVAL: the source names a block that the view does not have. */
int ggn_study_source_check(const struct ggn_study_source *source, const struct ggn_study_view *view, struct base_err *err);

/* These make the view that is the index-th of the study from the source: its blocks, levels and files. */
struct ggn_study_request_views;
struct base_threads;
int ggn_study_prepare_sequence(const struct ggn_study_request_views *q, const struct ggn_study_source *source, int index,
                               struct ggn_study_view *view, struct base_threads *threads, struct base_err *err);
/* Of a validation the first view also says which conditions there are. */
int ggn_study_prepare_pictures(const struct ggn_study_request_views *q, const struct ggn_study_source *source, int index,
                               struct ggn_study *study, struct base_err *err);

#endif
