/* Criteria by name, where the loader looks for them. */
#ifndef PT_RENDER_HOST_FIND_H
#define PT_RENDER_HOST_FIND_H

#include <lull/criterion.h>

#include <stdio.h>

#include "base/err.h"
#include "base/inputs.h"
#include "base/log.h"

/* The criterion that spec names (NAME, PATH.so or PATH.so:ID): a table that lives for ever. What the loader says is noted
 * in the log, which may be NULL. The library is put into `inputs`, which may be NULL. */
int pt_criterion_find(const char *spec, struct base_inputs *inputs, struct base_log *log, const struct lull_criterion **out,
                      struct base_err *err);

/* Its name and description, for people. */
void pt_criterion_describe(const struct lull_criterion *table, FILE *out);

/* Every criterion that can be found, with its parameters, for people. Returns the number listed. */
int pt_criterion_list(FILE *out, struct base_log *log);

#endif
