#include "cli/commands.h"
int ggn_cmd_golden(int argc, char **argv)
{
    (void)argc;
    struct ggn_err err = {.code = GGN_EINVAL, .text = "not built yet"};
    return ggn_cmd_fail(argv[0], &err);
}
