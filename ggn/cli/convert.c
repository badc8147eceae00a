/* `ggn convert MODEL OUT`: a model with its weights stored in another type. */
#include "base/options.h"
#include "cli/commands.h"
#include "model/container.h"
#include "model/model.h"

struct options {
    const char *paths[2];
    int type;
};
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"type", 't', NULL, TO(type), .words = ggn_type_names, .help = "type of the stored weights (f16)"}, {0}};

int ggn_cmd_convert(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "MODEL OUT",
        .args_min = 2,
        .args_max = 2,
        .args_are = BASE_ARGS_FILES,
        .args_output = 2,
        .args = offsetof(struct options, paths),
        .doc = "Stores a model's weights in fewer (or more) bits. Half the size; decisions near the threshold may change, "
               "`ggn evaluate -m MODEL -m OUT` says which."};
    struct options o = {.type = GGN_F16};
    struct ggn_model *model = NULL;
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = base_file_check_kind(o.paths[1], &ggn_container_kind, err);
    if (!rc)
        rc = ggn_model_load(o.paths[0], &model, err);
    if (!rc)
        rc = ggn_model_save(model, o.paths[1], (enum ggn_type)o.type, err);
    ggn_model_destroy(model);
    return rc;
}
