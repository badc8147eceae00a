#define _GNU_SOURCE /* dladdr */
#include "plugin/model_path.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int gp_model_find(const char *name, const char *variable, char *path, size_t room)
{
    /* a prefix has us in lib/lull or lib/TRIPLET/lull; the tree in build/lib/lull and build/MODE/lib/lull */
    static const char *const places[] = {
        ".", "../share/lull", "../../share/lull", "../../../share/lull", "../../../ggn/models", "../../../../ggn/models"};
    static const char anchor = 0; /* an address inside this shared object */
    const char *named = variable ? getenv(variable) : NULL;
    char folder[4096] = ".";
    Dl_info info;

    if (named && *named) {
        snprintf(path, room, "%s", named);
        return 1;
    }
    if (dladdr(&anchor, &info) && info.dli_fname) {
        const char *slash = strrchr(info.dli_fname, '/');
        if (slash)
            snprintf(folder, sizeof folder, "%.*s", (int)(slash - info.dli_fname), info.dli_fname);
    }
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        int n = snprintf(path, room, "%s/%s/%s", folder, places[i], name);
        if (n > 0 && (size_t)n < room && access(path, R_OK) == 0)
            return 1;
    }
    snprintf(path, room,
             "no %s beside %.200s, in share/lull of its prefix or the source tree's ggn/models; give model=FILE%s%s", name,
             info.dli_fname ? info.dli_fname : "the criterion", variable ? " or set " : "", variable ? variable : "");
    return 0;
}
