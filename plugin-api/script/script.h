/*
 * What lull-python.so exports to the loader (src/loader.c), which looks it up by name: criteria that are Python files.
 * Any thread.
 */
#ifndef SCRIPT_SCRIPT_H
#define SCRIPT_SCRIPT_H

#include <lull/criterion.h>

/* Answers a request of `bytes` in place: answer() of plugin-api/python/lull/script.py. */
typedef void (*lull_script_answer_fn)(void *request, uint64_t bytes);

/* The criterion of this file: a table that lives for ever. LULL_E_IO: no file, no python3; LULL_E_INVALID: a fault of the
 * script, with its line. */
LULL_EXPORT int32_t lull_script_find(const char *path, const struct lull_criterion **out, struct lull_error *err);

/* Instances that are made from now on are answered by this function, in this process; NULL: by a python3 of their own. */
LULL_EXPORT void lull_script_answer_here(lull_script_answer_fn answer);

#endif
