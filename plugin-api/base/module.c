#include "base/module.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void *base_module_symbol(const char *file, const char *symbol, int share)
{
    char program[PATH_MAX], path[PATH_MAX + 64];
    ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    if (n <= 0)
        return NULL;
    program[n] = '\0';
    char *slash = strrchr(program, '/');
    int folder = slash ? (int)(slash + 1 - program) : 0;
    if (snprintf(path, sizeof path, "%.*s../lib/lull/modules/%s", folder, program, file) >= (int)sizeof path)
        return NULL;
    void *module = dlopen(path, share ? RTLD_NOW | RTLD_GLOBAL : RTLD_LAZY | RTLD_LOCAL);
    return module ? dlsym(module, symbol) : NULL;
}
