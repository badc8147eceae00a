/*
 * Parts of a program in shared objects of their own, loaded when something asks for them: their libraries take a third of a
 * second to load, or need not be installed. They lie in lib/lull/modules/ beside the program's bin/.
 */
#ifndef BASE_MODULE_H
#define BASE_MODULE_H

/* The address of `symbol` in ../lib/lull/modules/`file`, seen from the program's folder; NULL if there is no such file, it
 * cannot be loaded, or has none. The module stays loaded until the program ends. share: its libraries' symbols are visible
 * to whatever is loaded later. Thread-safe. */
void *base_module_symbol(const char *file, const char *symbol, int share);

#endif
