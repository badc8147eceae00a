/*
 * Shared objects that are loaded when something asks for them. Parts of a program are such: their libraries take a third of
 * a second to load, or need not be installed. They lie in lib/lull/modules/ beside the program's bin/, or in
 * lull/modules/ beside the host library.
 */
#ifndef BASE_MODULE_H
#define BASE_MODULE_H

#include "base/err.h"

/* Loads a file, by a path with a '/', or what the system knows by this name; `flags` are those of dlopen. NULL: *err says
 * why. dlopen itself would wait for a FIFO, die of a file that was cut short, call one of another processor missing, and
 * blame the file where memory is what lacks. */
void *base_module_open(const char *path, int flags, struct base_err *err);

/* The address of `symbol` in lull/modules/`file` beside the shared object that this is part of, or else in
 * ../lib/lull/modules/`file`, seen from the program's folder; NULL as above, or if it has none.
 * The module stays loaded until the program ends. share: its libraries' symbols are visible to whatever is loaded later.
 * Thread-safe. */
void *base_module_symbol(const char *file, const char *symbol, int share, struct base_err *err);

#endif
