/* Names of the views that people judged. Pure. */
#ifndef GGN_SIGHT_VIEW_NAME_H
#define GGN_SIGHT_VIEW_NAME_H

/* Whether two names are those of one view: SIN3D's own files and folders have the ending _part6, which others leave out. */
int ggn_view_is(const char *name, const char *other);

#endif
