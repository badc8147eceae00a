/* Where the build puts what a test of the ABI loads, seen from the test's own program, OUT/tests/abi/api_*. */
#ifndef TESTS_SUPPORT_API_FOLDERS_H
#define TESTS_SUPPORT_API_FOLDERS_H

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define API_CRITERIA "../../lib/lull" /* the criteria of the build */
#define API_PLUGINS "plugins"         /* those that are broken on purpose */

/* The folder `below` the program's, in path[room]; -1 if there is no telling. */
static inline int api_folder(char *path, size_t room, const char *below)
{
    char exe[1900];
    ssize_t length = readlink("/proc/self/exe", exe, sizeof exe - 1);
    if (length <= 0)
        return -1;
    exe[length] = '\0';
    *strrchr(exe, '/') = '\0';
    int n = snprintf(path, room, "%s/%s", exe, below);
    return n > 0 && (size_t)n < room ? 0 : -1;
}

#endif
