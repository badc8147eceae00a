/* `lull-study VERB DIR`: thresholds and judgements from people, on a page served from this machine. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "base/interrupt.h"
#include "base/options.h"
#include "base/threads.h"
#include "study/page_path.h"
#include "study/plan.h"
#include "study/prepare.h"
#include "study/report.h"
#include "study/server.h"
#include "study/status.h"
#include "study/token.h"
#include "study/transfer.h"

enum { EXIT_BAD_INPUT = 2 }; /* or bad usage, or an output could not be written; 1: out of memory */

/* Prints "lull-study VERB: text" on stderr and returns the exit status that err->code stands for. */
static int fail(const char *command, const struct base_err *err)
{
    fprintf(stderr, "%s: %s\n", command, err->text);
    return err->code == BASE_EINVAL || err->code == BASE_EIO ? EXIT_BAD_INPUT : EXIT_FAILURE;
}

/* --- init --- */

enum { TASK_THRESHOLDS, TASK_VALIDATION };
enum { MIN_SHOW_MS = 50 }; /* three pictures of a screen of 60 Hz; in less an interval may never be seen */

struct init_options {
    const char *args[1 + GGN_STUDY_MAX_VIEWS]; /* DIR and views */
    int n_args, n_views;
    const char *views[GGN_STUDY_MAX_VIEWS];
    int task, method, trials, repeats, show_ms, gap_ms, fps, break_every, block;
    uint32_t spp_min, spp_max;
    uint64_t seed;
    double catch_share, spacing;
    const char *asked_by, *contact;
    enum ggn_study_kind kinds[GGN_STUDY_KINDS];
    int n_kinds;
};

static int set_kinds(void *into, const char *value, struct base_err *err)
{
    struct init_options *o = into;
    unsigned seen = 0;
    o->n_kinds = 0;
    for (const char *at = value; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        int k = GGN_STUDY_KINDS - 1;
        while (k > 0 && (strncmp(at, ggn_study_kind_names[k], strlen(ggn_study_kind_names[k])) != 0 ||
                         !strchr(",", at[strlen(ggn_study_kind_names[k])])))
            k--;
        if (k == 0 || (seen & 1u << k))
            return base_fail(err, BASE_EINVAL, "expected some of noisy,denoised,blend, each once");
        seen |= 1u << k;
        o->kinds[o->n_kinds++] = (enum ggn_study_kind)k;
    }
    return 0;
}

static int add_view(void *into, const char *value, struct base_err *err)
{
    struct init_options *o = into;
    if (o->n_views == GGN_STUDY_MAX_VIEWS)
        return base_fail(err, BASE_EINVAL, "at most %d views", GGN_STUDY_MAX_VIEWS);
    o->views[o->n_views++] = value;
    return 0;
}

static const char *const task_words[] = {"thresholds", "validation", NULL};
static const char *const method_words[] = {"adjustment", "2ifc", NULL};

#define TO(member) BASE_TO(struct init_options, member)
static const struct base_option init_list[] = {
    {"task", 0, NULL, TO(task), .words = task_words, .help = "what people are asked (required)"},
    {"method", 0, NULL, TO(method), .words = method_words, .help = "how thresholds are measured (adjustment)"},
    {"views", 0, "FOLDER[:BLOCKS]", .set = add_view,
     .help = "a recorded sequence, or a folder of pictures; more may follow. BLOCKS: only these, e.g. 0,3,8-11"},
    {"kinds", 0, "LIST", .set = set_kinds,
     .help = "2ifc: of pictures rendered with --denoise, what is shown: some of noisy,denoised,blend, a view of each"},
    {"asked-by", 0, "NAME", TO(asked_by), .help = "who asks, as the page says it (required)"},
    {"contact", 0, "ADDRESS", TO(contact), .help = "whom to write to or to call, as the page says it (required)"},
    {"trials", 0, "N", TO(trials), GGN_STUDY_MIN_TRIALS, 1000,
     .help = "2ifc: trials per block, catch trials included, at least 10 (30)"},
    {"repeats", 0, "N", TO(repeats), 1, 100,
     .help = "adjustment: settings per block (2); validation: judgements per picture (1)"},
    {"catch", 0, "SHARE", TO(catch_share), 0, 0.5, .help = "2ifc, validation: share of catch trials (0.1)"},
    {"show", 0, "MS", TO(show_ms), MIN_SHOW_MS, 60000,
     .help = "2ifc: how long an interval is shown (700; clips: two loops)"},
    {"fps", 0, "N", TO(fps), 1, GGN_STUDY_MAX_FPS, .help = "2ifc: frames a second of clips (24)"},
    {"gap", 0, "MS", TO(gap_ms), 1, 60000, .help = "the blank between two pictures in the same place (400)"},
    {"break-every", 0, "N", TO(break_every), 0, 100000, .help = "offer a break after so many trials (60; 0: never)"},
    {"spacing", 0, "OCTAVES", TO(spacing), 0.01, 4, .help = "leave out levels that are nearer than that (0.15)"},
    {"spp-min", 0, "N", TO(spp_min), 1, 1e9, .help = "leave out levels below (1)"},
    {"spp-max", 0, "N", TO(spp_max), 1, 1e9, .help = "leave out levels above (1000000)"},
    {"block", 0, "PIXELS", TO(block), 8, 4096, .help = "side of a block when the view is a folder of pictures (200)"},
    {"seed", 0, "N", TO(seed), 0, 9007199254740991.0, .help = "of all orders and sides (1)"},
    {0}};
#undef TO

/* What one task alone listens to is refused in another: a study that ignores it would not be the one that was meant. */
static int options_fit(const struct init_options *o, enum ggn_study_task task, struct base_err *err)
{
    const struct {
        const char *name;
        int given, fits;
    } rules[] = {{"trials", o->trials != 0, task == GGN_STUDY_TWO_INTERVAL},
                 {"show", o->show_ms != 0, task == GGN_STUDY_TWO_INTERVAL},
                 {"fps", o->fps != 0, task == GGN_STUDY_TWO_INTERVAL},
                 {"kinds", o->n_kinds != 0, task == GGN_STUDY_TWO_INTERVAL},
                 {"gap", o->gap_ms != 0, task != GGN_STUDY_ADJUSTMENT},
                 {"catch", o->catch_share >= 0.0, task != GGN_STUDY_ADJUSTMENT},
                 {"repeats", o->repeats != 0, task != GGN_STUDY_TWO_INTERVAL}};
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++)
        if (rules[i].given && !rules[i].fits)
            return base_fail(err, BASE_EINVAL, "--%s does nothing in this task (%s)", rules[i].name,
                             ggn_study_task_names[task]);
    return 0;
}

/* Task, names and numbers of the study. */
static int define(const struct init_options *o, struct ggn_study *study, struct base_err *err)
{
    int validation = o->task == TASK_VALIDATION;
    if (o->task < 0 || o->n_views == 0)
        return base_fail(err, BASE_EINVAL, "--task and --views are needed");
    if (validation && o->method >= 0)
        return base_fail(err, BASE_EINVAL, "--method goes with --task thresholds");
    if (!o->asked_by || !o->contact)
        return base_fail(err, BASE_EINVAL,
                         "--asked-by NAME and --contact ADDRESS are needed: the page tells people who asks them and whom to "
                         "write to");
    if (!ggn_study_plain_line(o->asked_by) || !ggn_study_plain_line(o->contact))
        return base_fail(err, BASE_EINVAL, "--%s: expected one line of at most %d bytes that is not blank",
                         ggn_study_plain_line(o->asked_by) ? "contact" : "asked-by", GGN_STUDY_LINE - 1);
    study->task = validation ? GGN_STUDY_VALIDATION : o->method == 1 ? GGN_STUDY_TWO_INTERVAL : GGN_STUDY_ADJUSTMENT;
    if (options_fit(o, study->task, err))
        return err->code;
    snprintf(study->asked_by, sizeof study->asked_by, "%s", o->asked_by);
    snprintf(study->contact, sizeof study->contact, "%s", o->contact);
    study->min_ms = ggn_study_min_ms[study->task];
    study->repeats = o->repeats ? o->repeats : study->task == GGN_STUDY_ADJUSTMENT ? 2 : 1;
    study->seed = o->seed;
    study->trials = o->trials ? o->trials : 30;
    study->catch_share = o->catch_share >= 0.0 ? o->catch_share : 0.1;
    study->show_ms = o->show_ms;
    study->fps = o->fps;
    study->gap_ms = o->gap_ms ? o->gap_ms : 400;
    study->break_every = o->break_every;
    return 0;
}

static int init(struct init_options *o, struct ggn_study *study, struct base_err *err)
{
    char page[4096];
    for (int i = 1; i < o->n_args; i++)
        if (add_view(o, o->args[i], err))
            return err->code;
    if (define(o, study, err))
        return err->code;
    struct ggn_study_request_views q = {.dir = o->args[0],
                                        .page_dir = page,
                                        .views = o->views,
                                        .n_views = o->n_views,
                                        .n_kinds = o->n_kinds,
                                        .block = o->block,
                                        .spacing = o->spacing,
                                        .spp_min = o->spp_min,
                                        .spp_max = o->spp_max};
    memcpy(q.kinds, o->kinds, sizeof q.kinds);
    struct base_threads *threads = base_threads_create(base_threads_available(), err);
    int rc = threads ? ggn_study_page_find(page, err) : err->code;
    if (!rc)
        rc = ggn_study_prepare(&q, study, threads, err);
    base_threads_destroy(threads);
    return rc;
}

static int run_init(int argc, char **argv)
{
    static const struct base_options options = {.list = init_list,
                                                .args_doc = "DIR --task TASK --views FOLDER...",
                                                .args_min = 1,
                                                .args_max = 1 + GGN_STUDY_MAX_VIEWS,
                                                .args = offsetof(struct init_options, args),
                                                .arg_count = offsetof(struct init_options, n_args),
                                                .doc = "Makes the study DIR: study.json, the pictures it shows, and "
                                                       "texts.json, what the page says (edit or translate it)."};
    struct init_options *o = calloc(1, sizeof *o);
    struct ggn_study study = {.min_catch_passed = 0.75, .max_untouched = 0.5, .max_fast = 0.1};
    struct base_err err = {0};
    if (!o) {
        base_fail_nomem(&err, "options");
        return fail(argv[0], &err);
    }
    *o = (struct init_options){.task = -1,
                               .method = -1,
                               .break_every = 60,
                               .block = 200,
                               .spp_min = 1,
                               .spp_max = 1000000,
                               .seed = 1,
                               .catch_share = -1.0,
                               .spacing = 0.15};
    int rc = base_options_parse(&options, argc, argv, o, &err);
    if (!rc)
        rc = init(o, &study, &err);
    if (!rc)
        printf("%s: %d view%s, %d trials for each person, some %.0f min; `lull-study serve %s` opens it\n", o->args[0],
               study.n_views, study.n_views == 1 ? "" : "s", ggn_study_plan_count(&study),
               ceil(ggn_study_plan_minutes(&study)), o->args[0]);
    ggn_study_release(&study);
    free(o);
    return rc ? fail(argv[0], &err) : EXIT_SUCCESS;
}

/* --- the other verbs: a folder, and an option or an argument more --- */

struct options {
    const char *args[2]; /* DIR; what is imported or deleted */
    const char *listen, *out;
    int no_noise_maps;
};
#define TO(member) BASE_TO(struct options, member)
#define ARGS(n) .args_min = n, .args_max = n, .args = offsetof(struct options, args), .args_are = BASE_ARGS_FILES
static const struct base_option no_options[] = {{0}};

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

static const struct base_option serve_list[] = {
    {"listen", 'l', "ADDRESS[:PORT]", TO(listen),
     .help = "where to listen, in numbers (127.0.0.1:8737; port 0: any). Beyond this machine the link has a token"},
    {0}};

static int serve(const struct options *o, struct base_err *err)
{
    struct ggn_study study = {0};
    struct ggn_study_store *store = NULL;
    struct ggn_study_address address;
    char page[4096], token[GGN_STUDY_KEY];
    int rc = ggn_study_address_parse(o->listen, &address, err);
    if (!rc)
        rc = ggn_study_page_find(page, err);
    if (!rc)
        rc = ggn_study_read(o->args[0], &study, err);
    if (!rc && !address.loopback)
        rc = keep_token(o->args[0], token, err);
    if (!rc)
        rc = ggn_study_store_open(o->args[0], study.id, 1, &store, err);
    if (!rc)
        rc = ggn_study_store_sync_behind(store, err);
    if (!rc) {
        struct ggn_study_site site = {
            .dir = o->args[0], .page_dir = page, .token = address.loopback ? NULL : token, .study = &study, .store = store};
        base_interrupt_catch();
        rc = ggn_study_serve(&site, &address, &base_interrupted, err);
    }
    ggn_study_store_close(store);
    ggn_study_release(&study);
    return rc;
}

static int run_serve(int argc, char **argv)
{
    static const struct base_options options = {
        .list = serve_list,
        .args_doc = "DIR",
        ARGS(1),
        .doc =
            "Serves the study until interrupted and prints its link. However the server ends, no trial that it acknowledged "
            "is lost; a power cut may take those of the last moment, which are asked again."};
    struct options o = {.listen = "127.0.0.1"};
    struct base_err err = {0};
    int rc = base_options_parse(&options, argc, argv, &o, &err);
    if (!rc)
        rc = serve(&o, &err);
    return rc ? fail(argv[0], &err) : EXIT_SUCCESS;
}

/* --- what was collected --- */

typedef int work_fn(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                    struct base_err *err);

/* Reads the command line and runs `work` on the study of DIR and its people; create: though nobody has taken part. */
static int with_store(const struct base_options *options, int argc, char **argv, int create, work_fn *work)
{
    struct options o = {0};
    struct ggn_study study = {0};
    struct ggn_study_store *store = NULL;
    struct base_err err = {0};
    int rc = base_options_parse(options, argc, argv, &o, &err);
    if (!rc)
        rc = ggn_study_read(o.args[0], &study, &err);
    if (!rc)
        rc = ggn_study_store_open(o.args[0], study.id, create, &store, &err);
    if (!rc)
        rc = work(&o, &study, store, &err);
    ggn_study_store_close(store);
    ggn_study_release(&study);
    return rc ? fail(argv[0], &err) : EXIT_SUCCESS;
}

static int do_report(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                     struct base_err *err)
{
    char folder[4096], table[4096];
    struct ggn_study_people people = {0};
    struct base_threads *threads = NULL;
    int rc = base_file_join(folder, o->args[0], "report", err);
    const char *out = o->out ? o->out : folder;
    if (!rc)
        rc = base_file_join(table, out, "people.csv", err);
    if (!rc)
        rc = ggn_study_protect(o->args[0], table, err);
    if (!rc && !(threads = base_threads_create(base_threads_available(), err)))
        rc = err->code;
    if (!rc)
        rc = ggn_study_people_init(&people, study, store, threads, err);
    if (!rc)
        rc = ggn_study_people_estimate(&people, threads, err);
    if (!rc)
        rc = ggn_study_report(out, &people, !o->no_noise_maps, err);
    ggn_study_people_release(&people);
    base_threads_destroy(threads);
    return rc;
}

static const struct base_option report_list[] = {
    {"output", 'o', "FOLDER", TO(out), .help = "where the report goes (DIR/report)"},
    {"no-pictures", 'n', NULL, TO(no_noise_maps), .help = "tables only"},
    {0}};

static int run_report(int argc, char **argv)
{
    static const struct base_options options = {
        .list = report_list,
        .args_doc = "DIR",
        ARGS(1),
        .doc = "Thresholds with intervals (thresholds.csv is what `ggn label --human` and `ggn compare` read), who counts "
               "and why not, how "
               "well people agree; or shares of judgements with intervals, and how many people a difference of 10 % takes."};
    return with_store(&options, argc, argv, 0, do_report);
}

static int do_status(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                     struct base_err *err)
{
    struct ggn_study_people people = {0};
    struct base_threads *threads = base_threads_create(base_threads_available(), err);
    int rc = threads ? ggn_study_people_init(&people, study, store, threads, err) : err->code;
    (void)o;
    if (!rc)
        ggn_study_status(stdout, &people);
    ggn_study_people_release(&people);
    base_threads_destroy(threads);
    return rc;
}

static int run_status(int argc, char **argv)
{
    static const struct base_options options = {
        .list = no_options,
        .args_doc = "DIR",
        ARGS(1),
        .doc = "Who takes part, how far everybody is, how many catch trials they passed, how quickly they answer, and who "
               "would not count in a report made now. The study may be served at the same time."};
    return with_store(&options, argc, argv, 0, do_status);
}

static int do_export(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                     struct base_err *err)
{
    int people = 0, rc = ggn_study_protect(o->args[0], o->out, err);
    if (!rc)
        rc = ggn_study_export(study, store, o->out, &people, err);
    if (!rc)
        printf("%s: %d people\n", o->out, people);
    return rc;
}

static const struct base_option export_list[] = {
    {"output", 'o', "FILE", TO(out), .needed = 1, .output = BASE_FILE, .help = "the file to write (required)"}, {0}};

static int run_export(int argc, char **argv)
{
    static const struct base_options options = {
        .list = export_list,
        .args_doc = "DIR -o FILE",
        ARGS(1),
        .doc = "Writes all raw trials and what people told of themselves to one JSON file."};
    return with_store(&options, argc, argv, 0, do_export);
}

static int do_import(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                     struct base_err *err)
{
    int people = 0, rc = ggn_study_import(study, store, o->args[1], &people, err);
    if (!rc)
        printf("%s: %d people imported\n", o->args[0], people);
    return rc;
}

static int run_import(int argc, char **argv)
{
    static const struct base_options options = {
        .list = no_options,
        .args_doc = "DIR FILE",
        ARGS(2),
        .doc =
            "Adds everybody of an exported file to a copy of the same study: all of them or, if anything is amiss, nobody."};
    return with_store(&options, argc, argv, 1, do_import);
}

static int do_delete(const struct options *o, const struct ggn_study *study, struct ggn_study_store *store,
                     struct base_err *err)
{
    struct ggn_study_person person;
    (void)study;
    int found = ggn_study_store_find(store, NULL, o->args[1], &person, err);
    if (found <= 0)
        return found ? found : base_fail(err, BASE_EINVAL, "%s: nobody has the code %.32s", o->args[0], o->args[1]);
    int rc = ggn_study_store_delete(store, person.row, err);
    if (!rc)
        printf("%s: %s and all their trials are deleted; make the report again\n", o->args[0], person.id);
    return rc;
}

static int run_delete(int argc, char **argv)
{
    static const struct base_options options = {.list = no_options,
                                                .args_doc = "DIR PERSON",
                                                ARGS(2),
                                                .doc = "Deletes a person, by the code that the page showed them, and all "
                                                       "their trials. Exported files and reports made before still "
                                                       "hold them."};
    return with_store(&options, argc, argv, 0, do_delete);
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
    {"status", run_status, "who takes part, how far, how quickly"},
    {"report", run_report, "thresholds, agreement, judgements: CSV, JSON, pictures"},
    {"export", run_export, "all raw trials"},
    {"import", run_import, "raw trials of the same study"},
    {"delete", run_delete, "one participant and their trials"},
};
enum { N_VERBS = sizeof verbs / sizeof verbs[0] };

/* `lull-study` with options only. */
static int main_options(int argc, char **argv)
{
    char doc[1024];
    size_t used =
        (size_t)snprintf(doc, sizeof doc,
                         "Asks people, on a page that this machine serves: from how many samples on a block "
                         "looks converged, or whether a reconstructed picture looks the same as its reference.\vVerbs:\n");
    for (int i = 0; i < N_VERBS && used < sizeof doc; i++)
        used += (size_t)snprintf(doc + used, sizeof doc - used, "  %-8s %s\n", verbs[i].name, verbs[i].help);
    if (used < sizeof doc)
        snprintf(doc + used, sizeof doc - used, "\n`lull-study VERB --help` says more.");
    struct base_options options = {.doc = doc, .args_doc = "VERB DIR [OPTION...]", .list = no_options};
    struct base_err err = {0};
    if (!base_options_parse(&options, argc, argv, NULL, &err))
        base_fail(&err, BASE_EINVAL, "a verb is needed (lull-study --help lists them)");
    return fail("lull-study", &err);
}

/* Runs the verb of argv[1], which then reads "lull-study VERB". */
static int run(int argc, char **argv)
{
    struct base_err err = {0};
    for (int i = 0; i < N_VERBS; i++)
        if (strcmp(argv[1], verbs[i].name) == 0) {
            char name[64];
            snprintf(name, sizeof name, "lull-study %s", verbs[i].name);
            argv[1] = name;
            return verbs[i].run(argc - 1, argv + 1);
        }
    base_fail(&err, BASE_EINVAL, "%.64s: unknown verb (lull-study --help lists them)", argv[1]);
    return fail("lull-study", &err);
}

int main(int argc, char **argv)
{
    base_interrupt_begin();
    if (argc < 2 || argv[1][0] == '-')
        return main_options(argc, argv);
    int status = run(argc, argv);
    if (fflush(stdout) || ferror(stdout)) {
        fprintf(stderr, "lull-study: cannot write standard output\n");
        return status ? status : EXIT_BAD_INPUT;
    }
    return status;
}
