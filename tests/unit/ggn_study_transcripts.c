/* What study/ says, word by word, against what is recorded: plans, refusals, trials, turns, requests, imports. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "study/api.h"
#include "study/plan.h"
#include "study/server.h"
#include "study/store.h"
#include "study/study.h"
#include "study/token.h"
#include "study/transfer.h"
#include "support/ggn_study_made.h"
#include "support/ggn_transcript.h"

/* --- transcripts: every answer, every line, every slot --- */

static const char *const other_view[2] = {"\"views\":[",
                                          "\"views\":[{\"name\":\"w\",\"width\":30,\"height\":20,\"blocks\":["
                                          "{\"id\":3,\"x0\":0,\"y0\":0,\"x1\":30,\"y1\":10,\"levels\":[1,2,4,8,1000000000]},"
                                          "{\"id\":4,\"x0\":5,\"y0\":5,\"x1\":30,\"y1\":20,\"levels\":[20]}]},"};

static void print_plan(FILE *f, const struct ggn_study *s, uint64_t seed)
{
    struct ggn_study_plan p;
    assert_int_equal(ggn_study_plan_init(&p, s, seed, NULL), 0);
    fprintf(f, "%s, seed %d: %d of %d\n", ggn_study_task_names[s->task], (int)seed, p.n, ggn_study_plan_count(s));
    for (int i = 0; i < p.n; i++) {
        const struct ggn_study_slot *t = &p.slots[i];
        fprintf(f, " %d.%d:%d,%d%c%d.%d%s", t->view, t->block, t->condition, t->screen, "AB"[t->side], t -> start,
                (int)t -> catch_trial, i % 12 == 11 || i + 1 == p.n ? "\n" : "");
    }
    ggn_study_plan_release(&p);
}

/* view.block:condition,screen, side, start.catch */
static void plans_are_as_they_were(void **state)
{
    static const double shares[] = {0, 0.01, 0.1, 0.5};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    struct ggn_study s;
    struct base_err err = {0};
    (void)state;
    for (int task = 0; task < 3; task++) {
        study_text(ggn_study_task_names[task], other_view[0], other_view[1]);
        assert_int_equal(ggn_study_parse("test", text, strlen(text), &s, NULL), 0);
        for (uint64_t person = 0; person < 2; person++) {
            fprintf(f, "person %d: %.0f\n", (int)person, (double)ggn_study_person_seed(&s, person));
            print_plan(f, &s, person + 7);
        }
        for (int i = 0; i < 4; i++) {
            s.catch_share = shares[i];
            s.trials = 5;
            s.repeats = 1;
            print_plan(f, &s, 1);
        }
        ggn_study_release(&s);
    }
    for (int views = 1000; views <= 1001; views++) {
        struct ggn_study_plan p = {0};
        s = (struct ggn_study){.task = GGN_STUDY_VALIDATION,
                               .n_views = views,
                               .views = calloc((size_t)views, sizeof *s.views),
                               .n_conditions = 2,
                               .repeats = 100};
        int rc = ggn_study_plan_init(&p, &s, 1, &err);
        fprintf(f, "%d views: %d; %d %s\n", views, ggn_study_plan_count(&s), p.n, rc ? err.text : "");
        s.catch_share = 0.001;
        fprintf(f, "with catch trials: %d\n", ggn_study_plan_count(&s));
        ggn_study_plan_release(&p);
        ggn_study_release(&s);
    }
    transcript_end(&t, "study-plans");
}

static void studies_are_refused_in_these_words(void **state)
{
    static const char *const cases[][2] = {{"lull-study", "lull-sequence"},
                                           {"\"version\":1", "\"version\":0"},
                                           {"\"version\":1", "\"version\":2"},
                                           {"\"id\":\"0123", "\"id\":\"x123"},
                                           {"\"id\":\"0123", "\"id\":\"00123"},
                                           {"\"id\":\"0123", "\"id\":\"123"},
                                           {"\"seed\":7", "\"seed\":-1"},
                                           {"\"seed\":7", "\"seed\":9007199254740991"},
                                           {"\"seed\":7", "\"seed\":9007199254740992"},
                                           {"\"trials\":20", "\"trials\":x"},
                                           {"\"trials\":20", "\"trials\":0"},
                                           {"\"trials\":20", "\"trials\":1000"},
                                           {"\"trials\":20", "\"trials\":1001"},
                                           {"\"trials\":20", "\"trials\":2.5"},
                                           {"\"repeats\":3", "\"repeats\":0"},
                                           {"\"catch_share\":0.1", "\"catch_share\":-0.1"},
                                           {"\"catch_share\":0.1", "\"catch_share\":0.5"},
                                           {"\"catch_share\":0.1", "\"catch_share\":0.51"},
                                           {"\"show_ms\":700", "\"show_ms\":0"},
                                           {"\"gap_ms\":400", "\"gap_ms\":0"},
                                           {"\"break_every\":60", "\"break_every\":-1"},
                                           {"\"min_catch_passed\":0.75", "\"min_catch_passed\":1.01"},
                                           {"\"max_untouched\":0.5", "\"max_untouched\":null"},
                                           {"\"task\":\"", "\"task\":\"x"},
                                           {"\"conditions\":[\"a\",\"b\"]", "\"conditions\":[]"},
                                           {"\"conditions\":[\"a\",\"b\"]", "\"conditions\":[\"a\",\"\"]"},
                                           {"\"conditions\":[\"a\",\"b\"]", "\"conditions\":[\"a b\"]"},
                                           {"\"name\":\"v\"", "\"name\":\"../v\""},
                                           {"\"name\":\"v\"", "\"name\":\".v\""},
                                           {"\"name\":\"v\"", "\"name\":7"},
                                           {"\"name\":\"v\"", "\"name\":\"v.blend\",\"kind\":\"blend\""},
                                           {"\"name\":\"v\"", "\"name\":\"v.noisy\",\"kind\":\"blend\""},
                                           {"\"name\":\"v\"", "\"name\":\".blend\",\"kind\":\"blend\""},
                                           {"\"name\":\"v\"", "\"name\":\"v\",\"kind\":\"blend\""},
                                           {"\"name\":\"v\"", "\"name\":\"v.\",\"kind\":\"\""},
                                           {"\"name\":\"v\"", "\"name\":\"v.blend\",\"kind\":3"},
                                           {"\"width\":40", "\"frames\":16,\"width\":40"},
                                           {"\"width\":40", "\"frames\":18,\"width\":40"},
                                           {"\"width\":40", "\"frames\":1,\"width\":40"},
                                           {"\"width\":40", "\"frames\":61,\"width\":40"},
                                           {"\"width\":40", "\"frames\":2.5,\"width\":40"},
                                           {"\"show_ms\":700", "\"show_ms\":700,\"fps\":24"},
                                           {"\"show_ms\":700", "\"show_ms\":700,\"fps\":0"},
                                           {"\"show_ms\":700", "\"show_ms\":700,\"fps\":121"},
                                           {"\"width\":40", "\"width\":0"},
                                           {"\"width\":40", "\"width\":32769"},
                                           {"\"height\":10", "\"height\":9"},
                                           {"\"views\":[",
                                            "\"views\":[{\"name\":\"v\",\"width\":1,\"height\":1,\"blocks\":["
                                            "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":1,\"y1\":1,\"levels\":[1]}]},"},
                                           {"\"views\":[{", "\"views\":[1,{"},
                                           {"\"blocks\":[", "\"blocks\":[7,"},
                                           {"\"blocks\":[", "\"other\":["},
                                           {"\"views\":[", "\"views\":[],\"x\":["},
                                           {"\"x1\":40", "\"x1\":41"},
                                           {"\"x1\":40", "\"x1\":30"},
                                           {"\"x0\":30", "\"x0\":-1"},
                                           {"\"y0\":0", "\"y0\":10"},
                                           {"\"y0\":0", "\"y0\":9"},
                                           {"\"y1\":10", "\"y1\":0"},
                                           {"\"id\":5", "\"id\":2"},
                                           {"\"id\":5", "\"id\":3"},
                                           {"\"id\":5", "\"id\":32769"},
                                           {"[16,64,512]", "[16,64,64]"},
                                           {"[16,64,512]", "[16,64,65]"},
                                           {"[16,64,512]", "[]"},
                                           {"[16,64,512]", "[0,64]"},
                                           {"[16,64,512]", "[1,64]"},
                                           {"[16,64,512]", "[16,1000000000]"},
                                           {"[16,64,512]", "[16,1000000001]"},
                                           {"[16,64,512]", "[16.5]"},
                                           {"[16,64,512]", "[\"16\"]"},
                                           {"]}]}", ""},
                                           {"{", "["},
                                           {"\"trials\"", "\"min_ms\":-1,\"trials\""},
                                           {"\"trials\"", "\"min_ms\":60000,\"trials\""},
                                           {"\"trials\"", "\"min_ms\":60001,\"trials\""},
                                           {"\"trials\"", "\"max_fast\":1.01,\"trials\""},
                                           {"\"trials\"", "\"max_fast\":true,\"trials\""},
                                           {"\"trials\"", "\"asked_by\":\"Ada\",\"trials\""},
                                           {"\"trials\"", "\"asked_by\":7,\"trials\""},
                                           {"\"trials\"", "\"asked_by\":\"  \",\"trials\""},
                                           {"\"trials\"", "\"contact\":\"a\\nb\",\"trials\""},
                                           {"\"trials\"", "\"contact\":\"a\\u007fb\",\"trials\""}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (int task = 0; task < 3; task++)
        for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
            struct base_err err = {0};
            struct ggn_study s = {0};
            study_text(ggn_study_task_names[task], cases[i][0], cases[i][1]);
            int rc = ggn_study_parse("test", text, strlen(text), &s, &err);
            fprintf(f, "%s -> %.60s: %s\n", cases[i][0], cases[i][1], rc ? err.text : "taken");
            assert_true(!rc || !s.views);
            ggn_study_release(&s);
        }
    transcript_end(&t, "study-files");
}

struct asker {
    FILE *f;
    struct ggn_study study;
    struct ggn_study_store *store;
    struct ggn_study_site site;
    int people;
};

static void asker_init(struct asker *a, FILE *f, int task)
{
    *a = (struct asker){.f = f, .store = open_store(NULL)};
    parse(ggn_study_task_names[task], &a->study);
    a->site =
        (struct ggn_study_site){.dir = "tests/none", .page_dir = "ggn/study/page", .study = &a->study, .store = a->store};
    fprintf(f, "> %s\n", ggn_study_task_names[task]);
}

static void asker_release(struct asker *a)
{
    ggn_study_store_close(a->store);
    ggn_study_release(&a->study);
}

static void ask_with(struct asker *a, struct ggn_study_request q)
{
    struct ggn_study_response r;
    q.size = q.body ? strlen(q.body) : 0;
    ggn_study_answer(&a->site, &q, &r);
    fprintf(a->f, "%s %.80s %.100s\n  %d %s%s%s%s%s\n", q.method, q.path, q.body ? q.body : "", r.status, r.type,
            r.keep ? ", kept " : " ", r.fd >= 0 ? "a file" : r.body, r.why[0] ? ", logged: " : "", r.why);
    if (r.fd >= 0)
        close(r.fd);
    else
        assert_int_equal(r.size, strlen(r.body));
    free(r.body);
}

static void post(struct asker *a, const char *path, const char *body)
{
    ask_with(a,
             (struct ggn_study_request){.method = "POST", .path = path, .content_type = "application/json", .body = body});
}

/* A person with a plan of their own; their link is `%032x` of the number. */
static int64_t somebody(struct asker *a)
{
    struct ggn_study_person p = {.seed = 11, .created = "now"};
    a->people++;
    snprintf(p.id, sizeof p.id, "%08x", (unsigned)a->people);
    snprintf(p.key, sizeof p.key, "%032x", (unsigned)a->people);
    assert_int_equal(ggn_study_store_add_person(a->store, &p, "{}", NULL), 0);
    assert_int_equal(ggn_study_store_find(a->store, p.key, NULL, &p, NULL), 1);
    return p.row;
}

static void post_trial(struct asker *a, const char *body)
{
    char path[100];
    snprintf(path, sizeof path, "/api/people/%032x/trials", (unsigned)a->people);
    post(a, path, body);
}

enum { FIELDS = 7 };
static const char *const field[FIELDS] = {"slot", "revision", "level", "answer", "rating", "ms", "layout"};

/* The body of a trial with one field otherwise; with NULL: without it. */
static const char *trial_body(int task, const char *name, const char *value)
{
    static const char *const usual[3][FIELDS] = {{"0", "0", "64", "0", "0", "500", "\"\""},
                                                 {"0", "0", "64", "1", "0", "500.25", "\"\""},
                                                 {"0", "0", "0", "1", "3", "500", "\"beside\""}};
    static char body[400];
    size_t n = (size_t)snprintf(body, sizeof body, "{");
    for (int i = 0; i < FIELDS; i++) {
        const char *v = strcmp(field[i], name) == 0 ? value : usual[task][i];
        if (v)
            n += (size_t)snprintf(body + n, sizeof body - n, "%s\"%s\":%s", n > 1 ? "," : "", field[i], v);
    }
    snprintf(body + n, sizeof body - n, "}");
    return body;
}

static void print_trials(struct asker *a, int64_t row)
{
    struct ggn_study_trial *trials = NULL;
    int n = 0;
    assert_int_equal(ggn_study_store_trials(a->store, row, &trials, &n, NULL), 0);
    for (int i = 0; i < n; i++) {
        const struct ggn_study_trial *t = &trials[i];
        fprintf(a->f, "    stored %d.%d level %u answer %d rating %d ms %g layout '%s'%s\n", t->slot, t->revision, t->level,
                t->answer, t->rating, t->ms, t->layout, strlen(t->at) == 20 ? "" : ", no time");
    }
    free(trials);
}

/* Each field at its bounds, in each task. */
static void trials_are_answered_word_by_word(void **state)
{
    static const char *const values[][2] = {{"none", ""},
                                            {"slot", NULL},
                                            {"slot", "-1"},
                                            {"slot", "0.5"},
                                            {"slot", "\"0\""},
                                            {"slot", "1"},
                                            {"slot", "7"},
                                            {"slot", "8"},
                                            {"slot", "11"},
                                            {"slot", "12"},
                                            {"slot", "79"},
                                            {"slot", "80"},
                                            {"revision", NULL},
                                            {"revision", "-1"},
                                            {"revision", "1"},
                                            {"revision", "1000"},
                                            {"revision", "1001"},
                                            {"level", NULL},
                                            {"level", "0"},
                                            {"level", "63"},
                                            {"level", "16"},
                                            {"level", "256"},
                                            {"level", "512"},
                                            {"level", "64.5"},
                                            {"level", "-64"},
                                            {"level", "4294967360"},
                                            {"answer", NULL},
                                            {"answer", "-1"},
                                            {"answer", "0"},
                                            {"answer", "1"},
                                            {"answer", "2"},
                                            {"answer", "3"},
                                            {"rating", NULL},
                                            {"rating", "-1"},
                                            {"rating", "0"},
                                            {"rating", "1"},
                                            {"rating", "5"},
                                            {"rating", "6"},
                                            {"ms", NULL},
                                            {"ms", "-0.5"},
                                            {"ms", "0"},
                                            {"ms", "86400000"},
                                            {"ms", "86400000.5"},
                                            {"ms", "\"1\""},
                                            {"layout", NULL},
                                            {"layout", "\"flip\""},
                                            {"layout", "\"above\""},
                                            {"layout", "7"}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (int task = 0; task < 3; task++) {
        struct asker a;
        asker_init(&a, f, task);
        for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
            int64_t row = somebody(&a);
            post_trial(&a, trial_body(task, values[i][0], values[i][1]));
            print_trials(&a, row);
        }
        asker_release(&a);
    }
    transcript_end(&t, "study-trials");
}

/* Whose turn it is: in the plan's order, or in any order within the screens reached. */
static void turns_are_kept(void **state)
{
    static const int order[][2] = {{1, 0}, {5, 0}, {2, 0}, {2, 2}, {2, 1},  {2, 1},  {0, 0},  {0, 0},
                                   {1, 0}, {1, 1}, {3, 0}, {9, 0}, {5, 0},  {8, 0},  {4, 0},  {0, 1},
                                   {6, 0}, {7, 0}, {9, 0}, {8, 0}, {10, 0}, {11, 0}, {11, 1}, {11, 3}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    char body[200];
    (void)state;
    for (int task = 0; task < 2; task++) {
        struct asker a;
        asker_init(&a, f, task);
        int64_t row = somebody(&a);
        for (size_t i = 0; i < sizeof order / sizeof order[0]; i++) {
            snprintf(body, sizeof body, "{\"slot\":%d,\"revision\":%d,\"level\":64,\"answer\":%d,\"ms\":%d}", order[i][0],
                     task ? 0 : order[i][1], task ? 2 : 0, (int)i);
            post_trial(&a, body);
        }
        for (int slot = 0; slot < 4 && task; slot++) {
            snprintf(body, sizeof body, "{\"slot\":%d,\"level\":64,\"answer\":1,\"ms\":5}", slot);
            post_trial(&a, body);
            post_trial(&a, body);
        }
        print_trials(&a, row);
        ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/api/people/00000000000000000000000000000001"});
        asker_release(&a);
    }
    transcript_end(&t, "study-turns");
}

/* Addresses, methods, where a request comes from, and sizes at their bounds. */
static void requests_are_answered_word_by_word(void **state)
{
    static const char *const gets[] = {"",
                                       "/",
                                       "/index.html",
                                       "/main.js",
                                       "main.js",
                                       "/none.js",
                                       "/study.css",
                                       "/vendor/jspsych.js",
                                       "/vendor",
                                       "/vendor/",
                                       "/a/b/c.js",
                                       "/texts.json",
                                       "/stimuli/v0/x.png",
                                       "/stimuli/x.png",
                                       "/stimuli",
                                       "/README.md",
                                       "/.hidden.js",
                                       "/api/study",
                                       "/api/people",
                                       "/api/people/",
                                       "/api/people/00000000000000000000000000000001",
                                       "/api/people/00000000000000000000000000000001/",
                                       "/api/people/00000000000000000000000000000001/trials",
                                       "/api/people/0000000000000000000000000000001",
                                       "/api/people/000000000000000000000000000000001",
                                       "/api/people/00000000000000000000000000000001x"};
    static const char *const posts[][2] = {
        {"/api/people", "{}"},
        {"/api/people", "{\"consent\":1}"},
        {"/api/people", "[]"},
        {"/api/people", "{"},
        {"/api/people", NULL},
        {"/api/peoples", "{}"},
        {"/main.js", "{}"},
        {"/api/people/00000000000000000000000000000001", "{}"},
        {"/api/people/00000000000000000000000000000001/profiles", "{}"},
        {"/api/people/00000000000000000000000000000002/profile", "{}"},
        {"/api/people/00000000000000000000000000000001/profile", " { \"a\" : [1, 2.50] } "}};
    const char *const hosts[] = {"one:1", "two:2", NULL};
    struct transcript t;
    struct asker a;
    (void)state;
    asker_init(&a, transcript_begin(&t), GGN_STUDY_VALIDATION);
    somebody(&a);
    for (size_t i = 0; i < sizeof posts / sizeof posts[0]; i++)
        post(&a, posts[i][0], posts[i][1]);
    for (size_t i = 0; i < sizeof gets / sizeof gets[0]; i++)
        ask_with(&a, (struct ggn_study_request){.method = "GET", .path = gets[i]});
    for (int n = GGN_STUDY_PROFILE_MAX - 8; n <= GGN_STUDY_PROFILE_MAX - 7; n++) {
        char *body = calloc(1, (size_t)n + 9);
        sprintf(body, "{\"a\":\"%*s\"}", n, "");
        post(&a, "/api/people/00000000000000000000000000000001/profile", body);
        free(body);
    }
    ask_with(&a, (struct ggn_study_request){.method = "HEAD", .path = "/api/study"});
    ask_with(&a, (struct ggn_study_request){.method = "PUT", .path = "/api/study"});
    const struct ggn_study_request from[] = {{.content_type = NULL},
                                             {.content_type = "application/jso"},
                                             {.content_type = "application/json; charset=utf-8"},
                                             {.content_type = "text/json"},
                                             {.content_type = "application/json", .fetch_site = "same-site"},
                                             {.content_type = "application/json", .fetch_site = "same-origin"},
                                             {.content_type = "application/json", .origin = "http://one:1", .host = "one:1"},
                                             {.content_type = "application/json", .origin = "http://one:1"},
                                             {.content_type = "application/json", .origin = "null", .host = "one:1"},
                                             {.content_type = "application/json", .origin = "http://two:2", .host = "one:1"},
                                             {.content_type = "application/json", .host = "two:2"},
                                             {.content_type = "application/json", .host = "two"}};
    for (int known = 0; known < 2; known++) {
        a.site.hosts = known ? hosts : NULL;
        for (size_t i = 0; i < sizeof from / sizeof from[0]; i++) {
            struct ggn_study_request q = from[i];
            fprintf(a.f, "host %s, origin %s, %s, %s: ", q.host ? q.host : "-", q.origin ? q.origin : "-",
                    q.fetch_site ? q.fetch_site : "-", q.content_type ? q.content_type : "-");
            q.method = "POST";
            q.path = "/api/people";
            q.body = "{\"consent\":false}";
            ask_with(&a, q);
        }
    }
    a.site.hosts = NULL;
    a.site.token = ID;
    ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/" ID "/index.html"});
    ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/" ID});
    ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/1" ID "/index.html"});
    ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/index.html"});
    ask_with(&a, (struct ggn_study_request){.method = "GET", .path = "/00000000000000000000000000000001/index.html"});
    asker_release(&a);
    transcript_end(&t, "study-requests");
}

/* What an import takes and what it says of the rest; a trial of each kind comes back. */
static void imports_are_answered_word_by_word(void **state)
{
    static const char *const cases[][2] = {
        {"", ""},
        {"lull-study-trials", "lull-study"},
        {"\"study\":\t\"0", "\"study\":\t\"1"},
        {"\"people\":\t[", "\"people\":\t{"},
        {"\"id\":\t\"0000000a", "\"id\":\t\"0000000g"},
        {"\"id\":\t\"0000000a", "\"id\":\t\"00000000a"},
        {"\"id\":\t\"0000000a", "\"id\":\t\"000000a"},
        {"\"id\":\t\"0000000a", "\"id\":\t\"0000000b"},
        {"\"created\":\t\"2024-01-01T00:00:00Z", "\"created\":\t\"0123456789012345678901234567890"},
        {"\"created\":\t\"2024-01-01T00:00:00Z", "\"created\":\t\"01234567890123456789012345678901"},
        {"\"created\"", "\"made\""},
        {"\"seed\":\t", "\"seed\":\t-"},
        {"\"seed\":\t", "\"seed\":\t0.5"},
        {"\"seed\":\t", "\"sed\":\t"},
        {"\"profile\":\t{", "\"profile\":\t[{"},
        {"\"trials\":\t[", "\"trials\":\t7,\"x\":\t["},
        {"\"slot\":\t0", "\"slot\":\t-1"},
        {"\"slot\":\t0", "\"slot\":\t79"},
        {"\"slot\":\t0", "\"slot\":\t80"},
        {"\"slot\":\t0", "\"slot\":\t0.5"},
        {"\"slot\":\t0", "\"slot\":\t1"},
        {"\"revision\":\t0", "\"revision\":\t1000"},
        {"\"revision\":\t0", "\"revision\":\t1001"},
        {"\"revision\":\t0", "\"revision\":\t-1"},
        {"\"level\":\t64", "\"level\":\t16"},
        {"\"level\":\t64", "\"level\":\t65"},
        {"\"level\":\t64", "\"level\":\t4294967360"},
        {"\"answer\":\t1", "\"answer\":\t0"},
        {"\"answer\":\t1", "\"answer\":\t3"},
        {"\"rating\":\t0", "\"rating\":\t5"},
        {"\"rating\":\t0", "\"rating\":\t6"},
        {"\"ms\":\t0.5", "\"ms\":\t86400000"},
        {"\"ms\":\t0.5", "\"ms\":\t86400001"},
        {"\"ms\":\t0.5", "\"ms\":\t-1"},
        {"\"layout\":\t\"", "\"layout\":\t\"012345678901234"},
        {"\"layout\":\t\"", "\"layout\":\t\"0123456789012345"},
        {"\"at\":\t\"2024-01-01T00:00:00Z", "\"at\":\t\"0123456789012345678901234567890"},
        {"\"at\":\t\"2024-01-01T00:00:00Z", "\"at\":\t\"01234567890123456789012345678901"}};
    char dir[] = "/tmp/ggn_study_XXXXXX", path[64], again[64], *exported, *bytes;
    struct transcript t;
    struct asker a;
    size_t size;
    int n = 0;
    (void)state;
    assert_non_null(mkdtemp(dir));
    snprintf(path, sizeof path, "%s/a.json", dir);
    snprintf(again, sizeof again, "%s/b.json", dir);
    asker_init(&a, transcript_begin(&t), GGN_STUDY_TWO_INTERVAL);
    for (int person = 0; person < 2; person++) {
        char id[] = "0000000a";
        id[7] = (char)(id[7] + person);
        int64_t row = add_person(a.store, id, 11 + (uint64_t)person);
        const struct ggn_study_trial trial = {.slot = 0, .level = 64, .answer = 1, .ms = 0.5, .at = "2024-01-01T00:00:00Z"};
        assert_int_equal(ggn_study_store_add_trial(a.store, row, &trial, NULL), 1);
    }
    assert_int_equal(ggn_study_export(&a.study, a.store, path, &n, NULL), 0);
    assert_int_equal(base_file_read(path, 1 << 20, &exported, &size, NULL), 0);
    fprintf(a.f, "%d\n%s", n, exported);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct ggn_study_store *to = open_store(NULL);
        struct base_err err = {0};
        char changed[8192];
        const char *at = strstr(exported, cases[i][0]);
        assert_non_null(at);
        snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - exported), exported, cases[i][1], at + strlen(cases[i][0]));
        assert_int_equal(base_file_write_line(path, changed, NULL), 0);
        n = -1;
        int rc = ggn_study_import(&a.study, to, path, &n, &err);
        fprintf(a.f, "%s -> %s: %s\n", cases[i][0], cases[i][1], rc ? err.text : "taken");
        assert_int_equal(ggn_study_export(&a.study, to, again, &n, NULL), 0);
        assert_int_equal(base_file_read(again, 1 << 20, &bytes, &size, NULL), 0);
        fprintf(a.f, "  %d people%s\n", n, strcmp(bytes, changed) && !rc ? ", not the same bytes" : "");
        free(bytes);
        ggn_study_store_close(to);
    }
    free(exported);
    asker_release(&a);
    unlink(path);
    unlink(again);
    rmdir(dir);
    transcript_hide(&t, dir, "DIR");
    transcript_end(&t, "study-imports");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plans_are_as_they_were),
        cmocka_unit_test(studies_are_refused_in_these_words),
        cmocka_unit_test(trials_are_answered_word_by_word),
        cmocka_unit_test(turns_are_kept),
        cmocka_unit_test(requests_are_answered_word_by_word),
        cmocka_unit_test(imports_are_answered_word_by_word),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
