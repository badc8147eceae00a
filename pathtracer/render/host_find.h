/* Criteria by name, where the loader looks for them. */
#ifndef PT_RENDER_HOST_FIND_H
#define PT_RENDER_HOST_FIND_H

#include <lull/criterion.h>

#include <stdio.h>

#include "base/err.h"
#include "base/inputs.h"

/* The criterion that spec names (NAME, PATH.so or PATH.so:ID): a table that lives for ever. warn gets one line per message
 * of the loader; may be NULL. The library is put into `inputs`, which may be NULL. */
int pt_criterion_find(const char *spec, struct base_inputs *inputs, void (*warn)(void *data, const char *line),
                      void *warn_data, const struct lull_criterion **out, struct base_err *err);

/* Every criterion that can be found, with its parameters, for people. Returns the number listed. */
int pt_criterion_list(FILE *out, void (*warn)(void *data, const char *line), void *warn_data);

#endif
