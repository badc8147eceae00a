/* Where the criterion finds its model when no parameter names one. Any thread. */
#ifndef GGN_PLUGIN_MODEL_PATH_H
#define GGN_PLUGIN_MODEL_PATH_H

#include <stddef.h>

/* The first of these that exists goes into path: $LULL_MODEL; beside the shared object; ../share/lull and ../../share/lull
 * from there (an installed tree); ggn/models of the source tree that it was built in. Without any, returns 0 and path holds
 * the list of places for the message. */
int gp_model_find(char *path, size_t room);

#endif
