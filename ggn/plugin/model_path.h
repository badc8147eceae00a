/* Where the criterion finds its model when no parameter names one. Any thread. */
#ifndef GGN_PLUGIN_MODEL_PATH_H
#define GGN_PLUGIN_MODEL_PATH_H

#include <stddef.h>

/* The first of these that exists goes into path: the one that the environment variable names (NULL: none); a file of this
 * name beside the shared object; share/lull of the prefix that it is installed in; ggn/models of the source tree that it was
 * built in. Without any, returns 0 and path holds the list of places for the message. */
int gp_model_find(const char *name, const char *variable, char *path, size_t room);

#endif
