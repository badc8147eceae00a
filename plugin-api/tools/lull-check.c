/* SPDX-License-Identifier: MIT
 *
 * lull-check: holds a stopping criterion against the whole contract of lull/criterion.h.
 */
#include "check.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/interrupt.h"
#include "base/options.h"
#include "base/threads.h"

enum { SPECS_MAX = 256 };

#define ROW(function, name, title) {name, title, lc_check_##function, NULL},
#define ROW_IN(function, name, title) {name, title, NULL, lc_check_##function},
static const struct {
    const char *name, *title;
    void (*run)(struct lc *c);
    void (*run_in)(struct lc *c, struct lc_session *s);
} checks[] = {LC_CHECKS(ROW, ROW_IN)};
enum { CHECKS = sizeof checks / sizeof *checks };

struct arguments {
    struct lc lc; /* what the checks get */
    int only_some;
    char only[CHECKS]; /* which */
    const char *specs[SPECS_MAX];
    int spec_count;
    unsigned limit_s;
    int quiet, list;
    int checks, failed; /* so far */
};

static int add_only(void *into, const char *name, struct base_err *err)
{
    struct arguments *a = into;
    for (int k = 0; k < CHECKS; k++)
        if (strcmp(checks[k].name, name) == 0) {
            a->only[k] = 1;
            a->only_some = 1;
            return 0;
        }
    return base_fail(err, BASE_EINVAL, "no such check; --list names them");
}

/* Splits the text, which is argv's, at its first '='. */
static int add_pair(void *into, const char *text, struct base_err *err)
{
    struct arguments *a = into;
    char *equals = strchr(text, '=');
    if (!equals || equals == text)
        return base_fail(err, BASE_EINVAL, "expected KEY=VALUE");
    if (a->lc.pair_count == LC_PAIRS_MAX)
        return base_fail(err, BASE_EINVAL, "more than %d parameters", LC_PAIRS_MAX);
    *equals++ = '\0';
    a->lc.pairs[a->lc.pair_count++] = (struct lull_pair){text, equals};
    return 0;
}

#define TO(member) BASE_TO(struct arguments, member)
static const struct base_option list[] = {
    {"param", 'p', "KEY=VALUE", .set = add_pair, .help = "Give the criterion this parameter (repeatable)"},
    {"only", 'o', "CHECK", .set = add_only, .help = "Run this check only (repeatable)"},
    {"list", 'l', NULL, TO(list), .help = "List the checks and exit"},
    {"required-only", 'r', NULL, TO(lc.required_only),
     .help = "Supply only the planes that it requires, as poorer hosts do"},
    {"quiet", 'q', NULL, TO(quiet), .help = "Print failures and the last line only"},
    {"threads", 't', "N", TO(lc.workers), 2, 32, .help = "Threads for the concurrent checks (4)"},
    {"limit", 'L', "SECONDS", TO(limit_s), 1, 100000, .help = "A check that takes longer has failed (120)"},
    {"misuse", 'm', "CALLS", TO(lc.misuse), 1, 1e12, .help = "Random calls outside the rules in the check misuse (2000)"},
    {"seed", 's', "N", TO(lc.seed), 0, 1e15, .help = "Where these calls begin (1)"},
    {0}};
static const struct base_options options = {
    .list = list,
    .args_doc = "CRITERION...",
    .args_max = SPECS_MAX,
    .args = offsetof(struct arguments, specs),
    .arg_count = offsetof(struct arguments, spec_count),
    .doc =
        "Holds stopping criteria against the whole contract of lull/criterion.h."
        "\vCRITERION is NAME (looked for in LULL_PLUGIN_PATH and in lib/lull beside this program), PATH (every criterion of "
        "the library, or a Python file) or PATH:ID. Each check runs in a process of its own; the output is TAP.\n\n"
        "Exit status: 0 all checks passed, 1 one failed, 2 wrong usage or no such criterion."};

/* In a child: reports the path and then the ids to check as notes; refuses what is no criterion. */
static void find(struct lc *c, const void *arg)
{
    const char *spec = arg;
    struct lull_search search = {0};
    struct lull_found found;
    struct lull_error err = {.struct_size = sizeof err};
    lc_doing(c, "in loading the library, or in its entry");
    if (lull_open(&search, spec, &found, &err) != LULL_OK) {
        size_t last = strlen(spec) > 0 ? strlen(spec) - 1 : 0;
        int senseless = spec[0] == '\0' || spec[0] == ':' || spec[last] == ':';
        if (senseless || err.code == LULL_E_KEY || (err.code == LULL_E_IO && access(spec, R_OK) != 0))
            lc_refuse(c, "%s", err.message);
        else
            lc_fail(c, "%s", err.message);
        return;
    }
    lc_note(c, "%s", found.path);
    const char *id = found.criterion->id;
    size_t length = strlen(spec), id_length = strlen(id);
    int is_path = !lc_is_script(found.path) && (strchr(spec, '/') || (length > 3 && strcmp(spec + length - 3, ".so") == 0));
    int names_id = length > id_length && spec[length - id_length - 1] == ':' && strcmp(spec + length - id_length, id) == 0;
    lull_entry_fn entry = is_path ? lc_entry(found.path) : NULL;
    if (!is_path || names_id)
        lc_note(c, "%s", id);
    else
        for (uint32_t i = 0; entry(i) != NULL; i++)
            lc_note(c, "%s", entry(i)->id);
}

/* Loads the criterion, in a child. */
static int find_table(struct lc *c, const char *id)
{
    lc_doing(c, "in loading the library, or in its entry");
    lull_entry_fn entry = lc_is_script(c->path) ? NULL : lc_entry(c->path);
    struct lull_found found = {0};
    if (!entry)
        lull_open(&(struct lull_search){0}, c->path, &found, NULL);
    c->criterion = found.criterion;
    for (uint32_t i = 0; entry && !c->criterion && entry(i); i++)
        if (strcmp(entry(i)->id, id) == 0)
            c->criterion = entry(i);
    return LC_EXPECT(c, c->criterion != NULL, "no criterion %s", id) ? 0 : -1;
}

/* A parameter without a default that the message names and the command line does not give; NULL: none. */
static const char *missing(const struct lc *c, const char *message)
{
    for (uint32_t i = 0; i < c->criterion->param_count; i++) {
        const struct lull_param *p = lc_param(c, i);
        int given = 0;
        for (uint32_t k = 0; k < c->pair_count; k++)
            given |= strcmp(c->pairs[k].key, p->name) == 0;
        if (!given && !p->default_value && strstr(message, p->name))
            return p->name;
    }
    return NULL;
}

/* And what it requires. Skips a criterion that wants a parameter, refuses parameters that are wrong. */
static int prepare(struct lc *c)
{
    struct lull_instance *instance = NULL;
    struct lull_error err = {.struct_size = sizeof err};
    lc_doing(c, "in create");
    int32_t status = c->criterion->create(NULL, c->pairs, c->pair_count, sizeof *c->pairs, &instance, &err);
    const char *wanted = status == LULL_E_VALUE ? missing(c, err.message) : NULL;
    if (wanted) {
        lc_skip(c, "it wants -p %s=...: %s", wanted, err.message);
        return -1;
    }
    if (c->pair_count > 0 && (status == LULL_E_KEY || status == LULL_E_VALUE)) {
        lc_refuse(c, "%s", err.message);
        return -1;
    }
    if (!LC_EXPECT(c, status == LULL_OK && instance, "create failed (%d): %s", status, err.message))
        return -1;
    c->req = (struct lull_requirements){.struct_size = sizeof c->req};
    lc_doing(c, "in requirements or destroy");
    status = c->criterion->requirements(instance, &c->req, &err);
    c->criterion->destroy(instance);
    c->planes = c->required_only ? c->req.planes_required : c->req.planes_used;
    return LC_EXPECT(c, status == LULL_OK, "requirements failed (%d): %s", status, err.message) ? 0 : -1;
}

struct task {
    const char *id;
    int check; /* CHECKS: only see whether the criterion can be made */
};

static void run_task(struct lc *c, const void *arg)
{
    const struct task *task = arg;
    if (find_table(c, task->id) != 0 || (task->check >= LC_WITHOUT_INSTANCE && prepare(c) != 0) || task->check == CHECKS)
        return;
    lc_doing(c, "%s", "");
    struct lc_session s;
    if (checks[task->check].run) {
        checks[task->check].run(c);
    } else if (lc_session_open(&s, c, NULL) == 0) {
        checks[task->check].run_in(c, &s);
        lc_session_close(&s);
    }
}

static void print_report(struct arguments *a, const char *name, const char *title, const struct lc_report *r)
{
    const int bad = r->failures > 0, shown = bad || !a->quiet;
    a->checks++;
    a->failed += bad;
    if (shown)
        printf("%sok %d - %s: %s", bad ? "not " : "", a->checks, name, title);
    for (unsigned i = 0; i < r->line_count && shown; i++)
        printf(bad ? "\n#   %s" : r->kind[i] == 'S' ? " # SKIP %s" : " (%s)", r->lines[i]);
    if (shown)
        putchar('\n');
    if (r->lines_left_out > 0)
        printf("#   and %u more\n", r->lines_left_out);
    fflush(stdout);
}

static int no_process(void)
{
    fputs("lull-check: cannot start a process\n", stderr);
    return LC_EXIT_FAILED;
}

static int check_criterion(struct arguments *a, struct lc *c, const char *id)
{
    static struct lc_report made, r;
    struct task task = {id, CHECKS};
    if (lc_child_run(c, run_task, &task, a->limit_s, &made) != 0)
        return no_process();
    if (made.refused) { /* the command line's parameters are wrong */
        fprintf(stderr, "lull-check: %s: %s\n", id, made.lines[0]);
        return LC_EXIT_USAGE;
    }
    if (!a->quiet)
        printf("# %s:%s\n", c->path, id);
    for (task.check = 0; task.check < CHECKS; task.check++) {
        if (task.check == LC_WITHOUT_INSTANCE && (made.failures > 0 || made.skipped)) {
            print_report(a, "create", "an instance can be made", &made);
            break;
        }
        if (a->only_some && !a->only[task.check])
            continue;
        if (lc_child_run(c, run_task, &task, a->limit_s, &r) != 0)
            return no_process();
        print_report(a, checks[task.check].name, checks[task.check].title, &r);
    }
    return LC_EXIT_OK;
}

static int check_spec(struct arguments *a, const char *spec)
{
    static struct lc_report r;
    struct lc c = a->lc;
    int status = LC_EXIT_OK;
    if (lc_child_run(&c, find, spec, a->limit_s, &r) != 0)
        return no_process();
    if (r.refused) {
        fprintf(stderr, "lull-check: %s\n", r.lines[0]);
        return LC_EXIT_USAGE;
    }
    if (r.failures > 0) {
        if (!a->quiet)
            printf("# %s\n", spec);
        print_report(a, "find", "the library can be loaded and its tables read", &r);
        return LC_EXIT_OK;
    }
    c.path = r.lines[0];
    for (unsigned i = 1; i < r.line_count && status == LC_EXIT_OK; i++)
        status = check_criterion(a, &c, r.lines[i]);
    return status;
}

static int run_program(int argc, char **argv)
{
    static struct arguments a = {.lc = {.workers = 4, .misuse = 2000, .seed = 1}, .limit_s = 120};
    struct base_err err = {0};
    base_interrupt_begin();
    if (!base_options_parse(&options, argc, argv, &a, &err) && a.spec_count == 0 && !a.list)
        base_fail(&err, BASE_EINVAL, "expected CRITERION... (--help says more)");
    if (err.code) {
        fprintf(stderr, "lull-check: %s\n", err.text);
        return LC_EXIT_USAGE;
    }
    if (a.list) {
        for (int k = 0; k < CHECKS; k++)
            printf("%-20s %s\n", checks[k].name, checks[k].title);
        return base_interrupt_end("lull-check", LC_EXIT_OK);
    }
    for (int i = 0; i < a.spec_count; i++) {
        int status = check_spec(&a, a.specs[i]);
        if (status != LC_EXIT_OK)
            return status;
    }
    printf("1..%d\n# %d checks, %d failed\n", a.checks, a.checks, a.failed);
    return base_interrupt_end("lull-check", a.failed > 0 ? LC_EXIT_FAILED : LC_EXIT_OK);
}

int main(int argc, char **argv) { return base_threads_main(argc, argv, run_program); }
