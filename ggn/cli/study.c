/* `ggn study VERB DIR`: thresholds and judgements from people, on a page served from this machine. */
#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "base/threads.h"
#include "cli/commands.h"
#include "study/page_path.h"
#include "study/plan.h"
#include "study/prepare.h"
#include "study/server.h"
#include "study/token.h"

/* --- init --- */

enum { MAX_VIEWS = GGN_STUDY_MAX_VIEWS, KEY_TASK = 256, KEY_METHOD, KEY_VIEWS, KEY_SEED, KEY_TRIALS, KEY_REPEATS, KEY_CATCH, KEY_SHOW,
       KEY_GAP, KEY_BREAK, KEY_BLOCK, KEY_SPACING, KEY_MIN, KEY_MAX };

struct init_options {
    const char *dir, *task, *method;
    const char *views[MAX_VIEWS];
    int n_views, block;
    double spacing, spp_min, spp_max, seed;
    struct ggn_study study;
};

static const struct argp_option init_table[] = {
    {"task", KEY_TASK, "thresholds|validation", 0, "what people are asked (required)", 1},
    {"method", KEY_METHOD, "adjustment|2ifc", 0, "how thresholds are measured (default adjustment)", 1},
    {"views", KEY_VIEWS, "FOLDER", 0, "a recorded sequence, or a folder of pictures; as many as wanted may follow", 1},
    {"trials", KEY_TRIALS, "N", 0, "2ifc: trials per block, catch trials included (default 30)", 2},
    {"repeats", KEY_REPEATS, "N", 0, "adjustment: settings per block (default 2); validation: judgements per picture (default 1)", 2},
    {"catch", KEY_CATCH, "SHARE", 0, "share of catch trials (default 0.1)", 2},
    {"show", KEY_SHOW, "MS", 0, "2ifc: how long an interval is shown (default 700)", 2},
    {"gap", KEY_GAP, "MS", 0, "2ifc: the blank between intervals (default 400)", 2},
    {"break-every", KEY_BREAK, "N", 0, "offer a break after so many trials (default 60, 0: never)", 2},
    {"spacing", KEY_SPACING, "OCTAVES", 0, "leave out levels that are nearer than that (default 0.15)", 3},
    {"spp-min", KEY_MIN, "N", 0, "leave out levels below (default 1)", 3},
    {"spp-max", KEY_MAX, "N", 0, "leave out levels above (default 1000000)", 3},
    {"block", KEY_BLOCK, "PIXELS", 0, "side of a block when the view is a folder of pictures (default 200)", 3},
    {"seed", KEY_SEED, "N", 0, "of all orders and sides (default 1)", 4},
    {0},
};

static double number_option(struct argp_state *state, const char *name, const char *arg, double lo, double hi)
{
    char *end;
    double value = strtod(arg, &end);
    if (end == arg || *end != '\0' || !(value >= lo && value <= hi))
        argp_error(state, "--%s %s: expected %g … %g", name, arg, lo, hi);
    return value;
}

static void add_view(struct argp_state *state, struct init_options *o, const char *folder)
{
    if (o->n_views == MAX_VIEWS)
        argp_error(state, "more than %d views", MAX_VIEWS);
    o->views[o->n_views++] = folder;
}

static void check_init(struct argp_state *state, struct init_options *o)
{
    if (!o->dir || !o->task || o->n_views == 0)
        argp_error(state, "DIR, --task and --views are needed");
    int validation = strcmp(o->task, "validation") == 0;
    if (!validation && strcmp(o->task, "thresholds") != 0)
        argp_error(state, "--task %s: expected thresholds or validation", o->task);
    if (o->method && (validation || (strcmp(o->method, "adjustment") != 0 && strcmp(o->method, "2ifc") != 0)))
        argp_error(state, "--method %s: expected adjustment or 2ifc, with --task thresholds", o->method);
    o->study.task = validation ? GGN_STUDY_VALIDATION : o->method && o->method[0] == '2' ? GGN_STUDY_TWO_INTERVAL : GGN_STUDY_ADJUSTMENT;
    if (o->study.repeats == 0)
        o->study.repeats = o->study.task == GGN_STUDY_ADJUSTMENT ? 2 : 1;
}

static error_t parse_init(int key, char *arg, struct argp_state *state)
{
    struct init_options *o = state->input;
    switch (key) {
    case KEY_TASK: o->task = arg; return 0;
    case KEY_METHOD: o->method = arg; return 0;
    case KEY_VIEWS: add_view(state, o, arg); return 0;
    case KEY_TRIALS: o->study.trials = (int)number_option(state, "trials", arg, 1, 1000); return 0;
    case KEY_REPEATS: o->study.repeats = (int)number_option(state, "repeats", arg, 1, 100); return 0;
    case KEY_CATCH: o->study.catch_share = number_option(state, "catch", arg, 0, 0.5); return 0;
    case KEY_SHOW: o->study.show_ms = (int)number_option(state, "show", arg, 1, 60000); return 0;
    case KEY_GAP: o->study.gap_ms = (int)number_option(state, "gap", arg, 1, 60000); return 0;
    case KEY_BREAK: o->study.break_every = (int)number_option(state, "break-every", arg, 0, 100000); return 0;
    case KEY_SPACING: o->spacing = number_option(state, "spacing", arg, 0.01, 4); return 0;
    case KEY_MIN: o->spp_min = number_option(state, "spp-min", arg, 1, 1e9); return 0;
    case KEY_MAX: o->spp_max = number_option(state, "spp-max", arg, 1, 1e9); return 0;
    case KEY_BLOCK: o->block = (int)number_option(state, "block", arg, 8, 4096); return 0;
    case KEY_SEED: o->seed = number_option(state, "seed", arg, 0, 9007199254740991.0); return 0;
    case ARGP_KEY_ARG:
        if (!o->dir)
            o->dir = arg;
        else
            add_view(state, o, arg);
        return 0;
    case ARGP_KEY_END: check_init(state, o); return 0;
    default: return ARGP_ERR_UNKNOWN;
    }
}

static int run_init(int argc, char **argv)
{
    static const struct argp argp = {
        .options = init_table, .parser = parse_init, .args_doc = "DIR --task TASK --views FOLDER...",
        .doc = "Makes the study DIR: study.json, the pictures it shows, and texts.json, what the page says (edit it: who asks, whom to write to)."};
    struct init_options o = {.block = 200, .spacing = 0.15, .spp_min = 1, .spp_max = 1e6, .seed = 1,
                             .study = {.trials = 30, .catch_share = 0.1, .show_ms = 700, .gap_ms = 400, .break_every = 60,
                                       .min_catch_passed = 0.75, .max_untouched = 0.5}};
    char page[4096];
    struct base_err err = {0};
    argp_parse(&argp, argc, argv, 0, NULL, &o);
    o.study.seed = (uint64_t)o.seed;
    struct ggn_study_request_views q = {.dir = o.dir, .page_dir = page, .views = o.views, .n_views = o.n_views, .block = o.block,
                                        .spacing = o.spacing, .spp_min = (uint32_t)o.spp_min, .spp_max = (uint32_t)o.spp_max};
    struct base_threads *threads = base_threads_create(base_threads_available(), &err);
    int rc = threads ? ggn_study_page_find(page, &err) : err.code;
    if (!rc)
        rc = ggn_study_prepare(&q, &o.study, threads, &err);
    if (!rc)
        printf("%s: %d view%s, %d trials for each person; `ggn study serve %s` opens it\n", o.dir, o.study.n_views,
               o.study.n_views == 1 ? "" : "s", ggn_study_plan_count(&o.study), o.dir);
    base_threads_destroy(threads);
    ggn_study_release(&o.study);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}

/* --- the other verbs: a folder and an option or two --- */

struct options {
    const char *dir, *listen, *out, *input, *person;
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct options *o = state->input;
    switch (key) {
    case 'l': o->listen = arg; return 0;
    case 'o': o->out = arg; return 0;
    case 'p': o->person = arg; return 0;
    case ARGP_KEY_ARG:
        if (!o->dir)
            o->dir = arg;
        else if (!o->input)
            o->input = arg;
        else
            return ARGP_ERR_UNKNOWN;
        return 0;
    case ARGP_KEY_END:
        if (!o->dir)
            argp_error(state, "DIR is needed");
        return 0;
    default: return ARGP_ERR_UNKNOWN;
    }
}

/* DIR/token: made once, so that links stay good. */
static int keep_token(const char *dir, char token[GGN_STUDY_KEY], struct base_err *err)
{
    char path[4096], *text = NULL;
    size_t size;
    int rc = base_file_join(path, dir, "token", err);
    if (rc)
        return rc;
    if (access(path, F_OK) != 0) {
        rc = ggn_study_token(token, GGN_STUDY_KEY - 1, err);
        return !rc ? base_file_write_line(path, token, err) : rc;
    }
    rc = base_file_read(path, 256, &text, &size, err);
    if (!rc && (strspn(text, "0123456789abcdef") != GGN_STUDY_KEY - 1 || size != GGN_STUDY_KEY))
        rc = base_fail(err, BASE_EINVAL, "%s: not a token; delete the file for a new one", path);
    if (!rc)
        snprintf(token, GGN_STUDY_KEY, "%.*s", GGN_STUDY_KEY - 1, text);
    free(text);
    return rc;
}

static const struct argp_option serve_table[] = {
    {"listen", 'l', "ADDRESS[:PORT]", 0, "where to listen, in numbers (default 127.0.0.1:8737; port 0: any). Beyond this machine the link has a token", 0},
    {0},
};

static int run_serve(int argc, char **argv)
{
    static const struct argp argp = {.options = serve_table, .parser = parse, .args_doc = "DIR",
                                     .doc = "Serves the study until interrupted and prints its link. Every trial is on the disk before it is acknowledged."};
    struct options o = {.listen = "127.0.0.1"};
    struct ggn_study study = {0};
    struct ggn_study_store *store = NULL;
    struct ggn_study_address address;
    char page[4096], token[GGN_STUDY_KEY];
    struct base_err err = {0};
    argp_parse(&argp, argc, argv, 0, NULL, &o);
    int rc = ggn_study_address_parse(o.listen, &address, &err);
    if (!rc)
        rc = ggn_study_page_find(page, &err);
    if (!rc)
        rc = ggn_study_read(o.dir, &study, &err);
    if (!rc && !address.loopback)
        rc = keep_token(o.dir, token, &err);
    if (!rc)
        rc = ggn_study_store_open(o.dir, study.id, 1, &store, &err);
    if (!rc) {
        struct ggn_study_site site = {.dir = o.dir, .page_dir = page, .token = address.loopback ? NULL : token, .study = &study, .store = store};
        ggn_cmd_catch_interrupt();
        rc = ggn_study_serve(&site, &address, &ggn_cmd_interrupted, &err);
    }
    ggn_study_store_close(store);
    ggn_study_release(&study);
    return !rc ? GGN_EXIT_OK : ggn_cmd_fail(argv[0], &err);
}

/* --- which verb --- */

struct verb {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *help;
};

static const struct verb verbs[] = {
    {"init", run_init, "make a study from recorded sequences or pictures"},
    {"serve", run_serve, "serve its page on this machine"},
};

static error_t parse_verb(int key, char *arg, struct argp_state *state)
{
    int *status = state->input;
    if (key == ARGP_KEY_NO_ARGS)
        argp_error(state, "a verb is needed: init, serve, report, export, import or delete");
    if (key != ARGP_KEY_ARG)
        return ARGP_ERR_UNKNOWN;
    for (size_t i = 0; i < sizeof verbs / sizeof verbs[0]; i++)
        if (strcmp(arg, verbs[i].name) == 0) {
            char name[64];
            char **rest = state->argv + state->next - 1;
            snprintf(name, sizeof name, "ggn study %s", verbs[i].name);
            rest[0] = name;
            *status = verbs[i].run(state->argc - state->next + 1, rest);
            state->next = state->argc;
            return 0;
        }
    argp_error(state, "unknown verb '%s'", arg);
    return 0;
}

int ggn_cmd_study(int argc, char **argv)
{
    static const struct argp argp = {
        .parser = parse_verb, .args_doc = "VERB DIR [OPTION...]",
        .doc = "Asks people, on a page that this machine serves: from how many samples on a block looks converged, or whether a "
               "reconstructed picture looks the same as its reference.\v"
               "Verbs:\n  init    make a study from recorded sequences or pictures\n  serve   serve its page on this machine\n"
               "  report  thresholds, agreement, judgements: CSV, JSON, pictures\n  export  all raw trials\n  import  raw trials of the same study\n"
               "  delete  one participant and their trials\n\n`ggn study VERB --help` says more."};
    int status = GGN_EXIT_OK;
    argp_parse(&argp, argc, argv, ARGP_IN_ORDER, NULL, &status);
    return status;
}
