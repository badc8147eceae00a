/* SPDX-License-Identifier: MIT
 *
 * lull/loader.h - the host's side: find, load and check criteria (lull/criterion.h).
 *
 * Not part of the ABI: liblull-host.so has it (lull/host.h), or a host compiles src/ in, with base/module.c and base/err.c.
 * Stateless; a library once loaded is never unloaded (a criterion's static tables live for ever, and unloading code that may
 * have registered anything with the runtime is not safe).
 * Every library is loaded RTLD_NOW | RTLD_LOCAL, so that all its symbols resolve and none reaches other libraries.
 *
 * Threads: calls may overlap, but the check that loading changes neither the floating-point control register nor the
 * number of threads is only meaningful while no other thread of the process starts or ends.
 */
#ifndef LULL_LOADER_H
#define LULL_LOADER_H

#include <lull/criterion.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LULL_PATH_MAX 4096

/* Where to search and where messages go. Borrowed for the call. */
struct lull_search {
    const char *const *dirs; /* each entry: one directory or several joined by ':'; NULL and "" are skipped; in order.
                              * dirs itself NULL: the usual ones, $LULL_PLUGIN_PATH, ../lib/lull from the folder of the
                              * running program, and lull beside liblull-host.so, if this code is in there, or beside
                              * what that links to */
    size_t dir_count;
    /* Told about libraries that are skipped and about side effects of loading; level is LULL_LOG_; may be NULL. */
    void (*log)(void *context, int32_t level, const char *text);
    void *log_context;
};

struct lull_found {
    const struct lull_criterion *criterion; /* static, lives for ever */
    char path[LULL_PATH_MAX];               /* the library it came from */
};

/* Finds and loads the criterion that spec names:
 *     NAME       the criterion with this id in DIR/NAME.so, else the first library in the directories that holds one; a
 *                DIR/NAME.so that holds others only is refused;
 *     PATH       (it contains a '/' or ends in ".so") the first criterion of this library;
 *     PATH:ID    the one with this id;
 *     PATH.py    the criterion that this Python file is (docs/python-criterion.md), of the id that its name gives it.
 * Returns LULL_OK and fills *found, or a LULL_E_ code with *found untouched and err (may be NULL) filled:
 * LULL_E_IO nothing there or not loadable, LULL_E_VERSION not an ABI 1 criterion, LULL_E_INVALID a broken table, LULL_E_KEY
 * the library holds no such id. */
LULL_EXPORT int32_t lull_open(const struct lull_search *search, const char *spec, struct lull_found *found,
                              struct lull_error *err);

/* From now on answer() answers for criteria that are Python files, in this process instead of a python3 of their own: that
 * of the package lull for Python (script.py), whose hosts need no other process. NULL: as before. */
LULL_EXPORT int32_t lull_answer_scripts(void (*answer)(void *request, uint64_t bytes), struct lull_error *err);

/* Calls visit for every valid criterion of every *.so in the directories, in directory order and by name within one.
 * A library name that appeared in an earlier directory is skipped. Broken libraries are logged and skipped. Stops early
 * when visit returns not 0, and returns that; else LULL_OK or LULL_E_MEMORY. */
LULL_EXPORT int32_t lull_list(const struct lull_search *search,
                              int32_t (*visit)(void *context, const struct lull_found *found), void *context);

/* Does this table keep the promises that can be seen without calling it? LULL_OK, or a code with err (may be NULL) filled.
 */
LULL_EXPORT int32_t lull_table_check(const struct lull_criterion *criterion, struct lull_error *err);

/* Fills err (may be NULL) with code and a printf-formatted message, cut to fit, and returns code. For hosts and criteria
 * alike; honours err->struct_size. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
LULL_EXPORT int32_t
lull_error_set(struct lull_error *err, int32_t code, const char *format, ...);

#ifdef __cplusplus
}
#endif

#endif
