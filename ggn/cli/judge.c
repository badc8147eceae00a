/* `ggn evaluate`, `ggn cost`, `ggn compare`: statistics of what `ggn replay` prints, and of thresholds. They are judged in
 * Python, lull/judge, started as the program that lies in lib/lull/modules beside the programs' bin. */
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/commands.h"

static const char place[] = "../lib/lull/modules/ggn-judge";

/* Goes on as that program, with the command's own arguments. Returns only if it cannot be started. */
static int judge(int argc, char **argv, struct base_err *err)
{
    char ggn[PATH_MAX], program[PATH_MAX + sizeof place];
    ssize_t n = readlink("/proc/self/exe", ggn, sizeof ggn - 1);
    char **words = calloc((size_t)argc + 3, sizeof *words);
    if (!words)
        base_fail_nomem(err, argv[0]);
    else if (n <= 0)
        base_fail(err, BASE_EIO, "/proc/self/exe cannot be read");
    else {
        ggn[n] = '\0';
        snprintf(program, sizeof program, "%.*s%s", (int)(strrchr(ggn, '/') + 1 - ggn), ggn, place);
        words[0] = program;
        words[1] = ggn;
        memcpy(words + 2, argv, (size_t)argc * sizeof *words);
        execv(program, words);
        base_fail(err, BASE_EIO, "no program ggn-judge in lib/lull/modules, or no /usr/bin/python3 that runs it");
    }
    free(words);
    return err->code;
}

int ggn_cmd_evaluate(int argc, char **argv, struct base_err *err) { return judge(argc, argv, err); }
int ggn_cmd_cost(int argc, char **argv, struct base_err *err) { return judge(argc, argv, err); }
int ggn_cmd_compare(int argc, char **argv, struct base_err *err) { return judge(argc, argv, err); }
