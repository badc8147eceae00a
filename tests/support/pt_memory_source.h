/* Scene files from memory. */
#ifndef TESTS_SUPPORT_PT_MEMORY_SOURCE_H
#define TESTS_SUPPORT_PT_MEMORY_SOURCE_H

#include "pbrt/source.h"

/* A file system of one file, `path` with text[0, size), that it borrows; every other path does not exist. */
struct pt_source_single {
    const char *path, *text;
    size_t size;
};
struct pt_source pt_source_from_memory(const struct pt_source_single *single);

#endif
