/* `ggn convert MODEL OUT`: a model with its weights stored in another type. */
#include <argp.h>
#include <string.h>

#include "cli/commands.h"
#include "model/container.h"
#include "model/model.h"

struct options {
    const char *paths[2];
    enum ggn_type type;
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct options *o = state->input;

    switch (key) {
    case 't':
        for (int t = 0; t < GGN_TYPES; t++)
            if (!strcmp(arg, ggn_type_name((enum ggn_type)t))) {
                o->type = (enum ggn_type)t;
                return 0;
            }
        argp_error(state, "--type %s: expected f32, f16 or bf16", arg);
        return 0;
    case ARGP_KEY_ARG:
        if (state->arg_num >= 2)
            argp_error(state, "one MODEL and one OUT at a time");
        else
            o->paths[state->arg_num] = arg;
        return 0;
    case ARGP_KEY_END:
        if (state->arg_num < 2)
            argp_error(state, "MODEL and OUT are needed");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

int ggn_cmd_convert(int argc, char **argv)
{
    static const struct argp_option list[] = {
        {"type", 't', "TYPE", 0, "Type of the stored weights: f16 (default), bf16 or f32", 0}, {0}};
    static const struct argp argp = {
        .options = list,
        .parser = parse,
        .args_doc = "MODEL OUT",
        .doc = "Stores a model's weights in fewer (or more) bits. Half the size; decisions near the threshold may change, "
               "`ggn evaluate -m MODEL -m OUT` says which."};
    struct options o = {.type = GGN_F16};
    struct ggn_model *model = NULL;
    struct base_err err = {0};

    argp_parse(&argp, argc, argv, 0, NULL, &o);
    int rc = ggn_model_load(o.paths[0], &model, &err);
    if (!rc)
        rc = ggn_model_save(model, o.paths[1], o.type, &err);
    ggn_model_destroy(model);
    return rc ? ggn_cmd_fail(argv[0], &err) : GGN_EXIT_OK;
}
