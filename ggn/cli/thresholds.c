/* `ggn thresholds FILE…`: the thresholds or stops that files hold, of whatever kind they are, as JSON. */
#include <cjson/cJSON.h>

#include "base/json.h"
#include "base/options.h"
#include "cli/commands.h"
#include "data/thresholds.h"
#include "picture/image.h"

enum { MAX_FILES = 64 };

struct options {
    const char *paths[MAX_FILES];
    int block[2];
};

static int set_block(void *into, const char *value, struct base_err *err)
{
    struct options *o = into;
    return base_parse_block(value, PIC_MAX_SIDE, o->block)
               ? 0
               : base_fail(err, BASE_EINVAL, "expected N or WxH, each from 1 to %d", PIC_MAX_SIDE);
}

static const struct base_option list[] = {
    {"block", 'b', "N|WxH", .set = set_block, .help = "blocks of an EXR that does not say theirs, in pixels (200)"}, {0}};

static void put_file(const struct ggn_thresholds *t, cJSON *to, int *failed)
{
    for (int i = 0; i < t->n; i++) {
        const struct ggn_view *v = &t->views[i];
        cJSON *view = base_json_object(to, NULL, failed);
        base_json_text(view, "name", v->name, failed);
        base_json_bool(view, "unnamed", v->unnamed, failed);
        base_json_bool(view, "of_study", v->of_study, failed);
        base_json_number(view, "columns", v->columns, failed);
        base_json_numbers(view, "spp", v->spp, v->n, failed);
    }
}

int ggn_cmd_thresholds(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "FILE...",
        .args_min = 1,
        .args_max = MAX_FILES,
        .args_are = BASE_ARGS_FILES,
        .args = offsetof(struct options, paths),
        .doc = "Prints the thresholds or stops of blocks as JSON: for each FILE a list of views. A file may be CSV "
               "(name;t0;...), a render's report JSON, labels.json, or an EXR with the channel lull.spp.V."};
    struct options o = {.block = {200, 200}};
    cJSON *root = cJSON_CreateArray();
    int failed = !root, rc = base_options_parse(&options, argc, argv, &o, err);
    for (int i = 0; i < MAX_FILES && o.paths[i] && !rc; i++) {
        struct ggn_thresholds t = {0};
        rc = ggn_thresholds_read(o.paths[i], o.block, &t, err);
        if (!rc)
            put_file(&t, base_json_array(root, NULL, &failed), &failed);
        ggn_thresholds_release(&t);
    }
    if (!rc)
        rc = base_json_write(NULL, root, failed, err);
    cJSON_Delete(root);
    return rc;
}
