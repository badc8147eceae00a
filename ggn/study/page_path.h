/* Where the program finds the page. Any thread. */
#ifndef GGN_STUDY_PAGE_PATH_H
#define GGN_STUDY_PAGE_PATH_H

#include "base/err.h"

/* The first of these folders that holds index.html goes into path (room for 4096 bytes): $LULL_STUDY_PAGE;
 * ../share/lull/study from the program (an installed tree); ggn/study/page of the source tree that it was built in. */
int ggn_study_page_find(char *path, struct base_err *err);

#endif
