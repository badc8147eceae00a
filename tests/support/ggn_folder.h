/* A folder of the test's own, made before its first test and removed after its last, and files in it. */
#ifndef TESTS_SUPPORT_GGN_FOLDER_H
#define TESTS_SUPPORT_GGN_FOLDER_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static char root[] = "/tmp/ggn_folder.XXXXXX";

static inline int folder_make(void **state)
{
    (void)state;
    return !mkdtemp(root) ? -1 : 0;
}

static inline int folder_remove(void **state)
{
    (void)state;
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", root);
    return system(command);
}

static inline void put_file(const char *name, const char *contents)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s", root, name);
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    fputs(contents, f);
    fclose(f);
}

#endif
