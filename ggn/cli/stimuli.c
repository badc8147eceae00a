/* `ggn stimuli VIEW...`: the pictures of recordings and renders that people are shown. */
#include <string.h>

#include "base/json.h"
#include "base/options.h"
#include "cli/commands.h"
#include "data/shown.h"

struct options {
    const char *views[GGN_SHOWN_MAX_VIEWS];
    struct ggn_shown_request request;
    int task;
};

static int set_kinds(void *into, const char *value, struct base_err *err)
{
    struct ggn_shown_request *q = &((struct options *)into)->request;
    unsigned seen = 0;
    q->n_kinds = 0;
    for (const char *at = value; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        const int k = 1 + base_word_index(ggn_shown_kind_names + 1, at, strcspn(at, ","));
        if (k == 0 || (seen & 1u << k))
            return base_fail(err, BASE_EINVAL, "expected some of noisy,denoised,blend, each once");
        seen |= 1u << k;
        q->kinds[q->n_kinds++] = (enum ggn_shown_kind)k;
    }
    return 0;
}

static const char *const task_words[] = {"adjustment", "2ifc", "validation", NULL}; /* enum ggn_shown_task */

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"output", 'o', "DIR", TO(request.dir), .needed = 1, .help = "where a folder v0, v1, … of each view is made (required)"},
    {"task", 0, NULL, TO(task), .words = task_words,
     .help = "what people are asked: validation takes whole pictures, 2ifc alone clips and kinds (2ifc)"},
    {"kinds", 0, "LIST", .set = set_kinds,
     .help = "of pictures rendered with --denoise, what is shown: some of noisy,denoised,blend, a view of each"},
    {"spacing", 0, "OCTAVES", TO(request.spacing), 0.01, 4, .help = "leave out levels that are nearer than that (0.15)"},
    {"spp-min", 0, "N", TO(request.spp_min), 1, 1e9, .help = "leave out levels below (1)"},
    {"spp-max", 0, "N", TO(request.spp_max), 1, 1e9, .help = "leave out levels above (1000000)"},
    {"block", 0, "PIXELS", TO(request.block), 8, 4096,
     .help = "side of a block when the view is a folder of pictures (200)"},
    {0}};
#undef TO

static void add_block(cJSON *blocks, const struct ggn_shown_block *b, int *failed)
{
    cJSON *o = base_json_object(blocks, NULL, failed);
    base_json_number(o, "id", b->id, failed);
    base_json_number(o, "x0", b->x0, failed);
    base_json_number(o, "y0", b->y0, failed);
    base_json_number(o, "x1", b->x1, failed);
    base_json_number(o, "y1", b->y1, failed);
    cJSON *levels = base_json_array(o, "levels", failed);
    for (int i = 0; i < b->n_levels; i++)
        base_json_number(levels, NULL, b->levels[i], failed);
}

static void add_view(cJSON *views, const struct ggn_shown_view *v, int whole, int *failed)
{
    cJSON *o = base_json_object(views, NULL, failed);
    base_json_text(o, "name", v->name, failed);
    base_json_number(o, "width", v->width, failed);
    base_json_number(o, "height", v->height, failed);
    if (v->kind)
        base_json_text(o, "kind", ggn_shown_kind_names[v->kind], failed);
    if (v->frames > 1)
        base_json_number(o, "frames", v->frames, failed);
    cJSON *blocks = whole ? NULL : base_json_array(o, "blocks", failed);
    for (int i = 0; i < v->n_blocks; i++)
        add_block(blocks, &v->blocks[i], failed);
}

/* "conditions" of a validation and "views", as study.json has them. */
static int print_shown(const struct ggn_shown *s, enum ggn_shown_task task, struct base_err *err)
{
    int failed = 0, whole = task == GGN_SHOWN_VALIDATION;
    cJSON *root = cJSON_CreateObject(), *conditions = whole ? base_json_array(root, "conditions", &failed) : NULL;
    for (int i = 0; i < s->n_conditions; i++)
        base_json_text(conditions, NULL, s->conditions[i], &failed);
    cJSON *views = base_json_array(root, "views", &failed);
    for (int i = 0; i < s->n_views; i++)
        add_view(views, &s->views[i], whole, &failed);
    int rc = base_json_write(NULL, root, failed || !root, err);
    cJSON_Delete(root);
    return rc;
}

static int make(struct options *o, struct ggn_shown *shown, struct base_err *err)
{
    o->request.task = (enum ggn_shown_task)o->task;
    o->request.views = o->views;
    if (o->request.n_kinds && o->task != GGN_SHOWN_TWO_INTERVAL)
        return base_fail(err, BASE_EINVAL, "--kinds does nothing in this task (%s)", task_words[o->task]);
    struct base_threads *threads = base_threads_create(base_threads_available(), err);
    int rc = threads ? ggn_shown_make(&o->request, shown, threads, err) : err->code;
    base_threads_destroy(threads);
    return rc;
}

int ggn_cmd_stimuli(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "VIEW[:BLOCKS]... -o DIR",
        .args_min = 1,
        .args_max = GGN_SHOWN_MAX_VIEWS,
        .args = offsetof(struct options, views),
        .arg_count = offsetof(struct options, request.n_views),
        .doc =
            "Writes what people are shown of recorded sequences or folders of pictures, each picture of a block a PNG, and "
            "prints as JSON which views, blocks and levels there are. `lull-study init` runs it."};
    static struct options o = {.task = GGN_SHOWN_TWO_INTERVAL,
                               .request = {.block = 200, .spp_min = 1, .spp_max = 1000000, .spacing = 0.15}};
    struct ggn_shown shown = {0};
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = make(&o, &shown, err);
    if (!rc)
        rc = print_shown(&shown, (enum ggn_shown_task)o.task, err);
    ggn_shown_release(&shown);
    return rc;
}
