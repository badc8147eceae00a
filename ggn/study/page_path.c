#include "study/page_path.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int has_page(const char *folder)
{
    char index[4200];
    snprintf(index, sizeof index, "%s/index.html", folder);
    return access(index, R_OK) == 0;
}

int ggn_study_page_find(char *path, struct base_err *err)
{
    /* build/bin and build/MODE/bin lie two and three folders below the tree's root */
    static const char *const places[] = {"../share/lull/study", "../../ggn/study/page", "../../../ggn/study/page"};
    const char *named = getenv("LULL_STUDY_PAGE");
    char program[3072];
    if (named && *named) {
        if (snprintf(path, 4096, "%s", named) < 4096 && has_page(path))
            return 0;
        return base_fail(err, BASE_EINVAL, "LULL_STUDY_PAGE=%.200s: no index.html in it", named);
    }
    ssize_t n = readlink("/proc/self/exe", program, sizeof program - 1);
    program[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(program, '/');
    if (slash)
        *slash = '\0';
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++)
        if (snprintf(path, 4096, "%s/%s", program, places[i]) < 4096 && has_page(path))
            return 0;
    return base_fail(err, BASE_EINVAL,
                     "the study's page is neither in ../share/lull/study nor in the source tree: set LULL_STUDY_PAGE");
}
