/* What a study is made of: its file, the plan of a person, the store of trials, export and import. */
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
#include "support/ggn_transcript.h"

#define ID "0123456789abcdef0123456789abcdef"

static char text[4096];

/* A study of one view with 4 blocks (ids 0, 1, 2, 5) and two conditions. */
static const char *study_text(const char *task, const char *instead_of, const char *with)
{
    char base[4096];
    snprintf(base, sizeof base,
             "{\"format\":\"lull-study\",\"version\":1,\"id\":\"" ID
             "\",\"task\":\"%s\",\"seed\":7,\"trials\":20,\"repeats\":3,"
             "\"catch_share\":0.1,\"show_ms\":700,\"gap_ms\":400,\"break_every\":60,\"min_catch_passed\":0.75,\"max_"
             "untouched\":0.5,"
             "\"conditions\":[\"a\",\"b\"],\"views\":[{\"name\":\"v\",\"width\":40,\"height\":10,\"blocks\":["
             "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":10,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":1,\"x0\":10,\"y0\":0,\"x1\":20,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":2,\"x0\":20,\"y0\":0,\"x1\":30,\"y1\":10,\"levels\":[16,64,256]},"
             "{\"id\":5,\"x0\":30,\"y0\":0,\"x1\":40,\"y1\":10,\"levels\":[16,64,512]}]}]}",
             task);
    char *at = instead_of ? strstr(base, instead_of) : NULL;
    if (!at)
        snprintf(text, sizeof text, "%s", base);
    else
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - base), base, with, at + strlen(instead_of));
    return text;
}

static void parse(const char *task, struct ggn_study *s)
{
    struct base_err err = {0};
    study_text(task, NULL, NULL);
    assert_int_equal(ggn_study_parse("test", text, strlen(text), s, &err), 0);
}

static void a_study_comes_back_as_it_was_written(void **state)
{
    struct ggn_study s, again;
    struct base_err err = {0};
    (void)state;
    for (int i = 0; i < 3; i++) {
        parse(ggn_study_task_names[i], &s);
        s.min_ms = 150.5;
        s.max_fast = 0.1;
        strcpy(s.asked_by, "Ada \"Example\"");
        memset(s.contact, 'c', GGN_STUDY_LINE - 1);
        char *first = ggn_study_print(&s);
        assert_int_equal(ggn_study_parse("test", first, strlen(first), &again, &err), 0);
        char *second = ggn_study_print(&again);
        assert_string_equal(first, second);
        assert_int_equal(again.task, i);
        assert_true(again.min_ms == 150.5 && again.max_fast == 0.1 && strlen(again.contact) == GGN_STUDY_LINE - 1);
        assert_string_equal(again.asked_by, "Ada \"Example\"");
        assert_int_equal(again.views[0].n_blocks, i == GGN_STUDY_VALIDATION ? 0 : 4);
        free(first);
        free(second);
        ggn_study_release(&s);
        ggn_study_release(&again);
    }
}

static void a_bad_study_is_refused(void **state)
{
    static const char *const cases[][2] = {{"lull-study", "lull-sequence"},
                                           {"\"version\":1", "\"version\":2"},
                                           {"\"id\":\"0123", "\"id\":\"x123"},
                                           {"\"seed\":7", "\"seed\":-7"},
                                           {"\"seed\":7", "\"seed\":\"7\""},
                                           {"\"trials\":20", "\"trials\":0"},
                                           {"\"trials\":20", "\"trials\":2.5"},
                                           {"\"name\":\"v\"", "\"name\":\"../v\""},
                                           {"\"name\":\"v\"", "\"name\":\".v\""},
                                           {"\"x1\":40", "\"x1\":41"},
                                           {"\"x1\":40", "\"x1\":30"},
                                           {"[16,64,512]", "[16,64,64]"},
                                           {"[16,64,512]", "[]"},
                                           {"[16,64,512]", "[0,64]"},
                                           {"\"id\":5", "\"id\":2"},
                                           {"\"catch_share\":0.1", "\"catch_share\":0.6"},
                                           {"\"task\":\"2ifc\"", "\"task\":\"taste\""},
                                           {"\"views\":[{", "\"views\":[1,{"},
                                           {"\"gap_ms\":400,", ""},
                                           {"]}]}", ""}};
    struct ggn_study s = {0};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct base_err err = {0};
        study_text("2ifc", cases[i][0], cases[i][1]);
        if (ggn_study_parse("test", text, strlen(text), &s, &err) != BASE_EINVAL || strncmp(err.text, "test: ", 6) != 0)
            fail_msg("%s -> %s: %s", cases[i][0], cases[i][1], err.text);
        assert_null(s.views);
    }
}

static void two_intervals_are_balanced(void **state)
{
    struct ggn_study s;
    struct ggn_study_plan p;
    struct base_err err = {0};
    (void)state;
    parse("2ifc", &s);
    for (uint64_t seed = 0; seed < 50; seed++) {
        int trials[4] = {0}, catches[4] = {0}, first[4] = {0};
        assert_int_equal(ggn_study_plan_init(&p, &s, seed, &err), 0);
        assert_int_equal(p.n, 80);
        assert_int_equal(p.n, ggn_study_plan_count(&s));
        for (int i = 0; i < p.n; i++) {
            const struct ggn_study_slot *slot = &p.slots[i];
            trials[slot->block]++;
            catches[slot->block] += slot->catch_trial == GGN_STUDY_CATCH_PLAIN;
            first[slot->block] += slot->side == 0;
            assert_true(i == 0 || slot->block != slot[-1].block);
        }
        for (int b = 0; b < 4; b++) {
            assert_int_equal(trials[b], 20);
            assert_int_equal(catches[b], 2);
            assert_int_equal(first[b], 10);
        }
        ggn_study_plan_release(&p);
    }
    ggn_study_release(&s);
}

static void a_plan_depends_on_the_seed_alone(void **state)
{
    struct base_err err = {0};
    (void)state;
    for (int task = 0; task < 3; task++) {
        struct ggn_study s;
        struct ggn_study_plan a, b, c;
        parse(ggn_study_task_names[task], &s);
        uint64_t one = ggn_study_person_seed(&s, 0), other = ggn_study_person_seed(&s, 1);
        assert_true(one != other && one < (UINT64_C(1) << 53));
        assert_int_equal(ggn_study_plan_init(&a, &s, one, &err) | ggn_study_plan_init(&b, &s, one, &err) |
                             ggn_study_plan_init(&c, &s, other, &err),
                         0);
        assert_int_equal(a.n, c.n);
        assert_memory_equal(a.slots, b.slots, (size_t)a.n * sizeof *a.slots);
        assert_memory_not_equal(a.slots, c.slots, (size_t)a.n * sizeof *a.slots);
        ggn_study_plan_release(&a);
        ggn_study_plan_release(&b);
        ggn_study_plan_release(&c);
        ggn_study_release(&s);
    }
}

static void validation_and_adjustment_show_everything(void **state)
{
    struct ggn_study s;
    struct ggn_study_plan p;
    struct base_err err = {0};
    int judged[2] = {0}, plain = 0, identical = 0, settings[3][4] = {{0}};
    (void)state;
    parse("validation", &s);
    assert_int_equal(ggn_study_plan_init(&p, &s, 1, &err), 0);
    for (int i = 0; i < p.n; i++) {
        plain += p.slots[i].catch_trial == GGN_STUDY_CATCH_PLAIN;
        identical += p.slots[i].catch_trial == GGN_STUDY_CATCH_IDENTICAL;
        if (p.slots[i].condition >= 0)
            judged[p.slots[i].condition]++;
    }
    assert_true(judged[0] == 3 && judged[1] == 3 && plain == 1 && identical == 1 && p.n == 8);
    ggn_study_plan_release(&p);
    ggn_study_release(&s);
    parse("adjustment", &s);
    assert_int_equal(ggn_study_plan_init(&p, &s, 1, &err), 0);
    for (int i = 0; i < p.n; i++) {
        settings[p.slots[i].screen][p.slots[i].block]++;
        assert_in_range(p.slots[i].start, 0, 2);
    }
    assert_int_equal(p.n, 12);
    for (int i = 0; i < 12; i++)
        assert_int_equal(settings[i / 4][i % 4], 1);
    ggn_study_plan_release(&p);
    ggn_study_release(&s);
}

static struct ggn_study_store *open_store(const char *dir)
{
    struct ggn_study_store *store = NULL;
    struct base_err err = {0};
    assert_int_equal(ggn_study_store_open(dir, ID, 1, &store, &err), 0);
    return store;
}

static int64_t add_person(struct ggn_study_store *store, const char *id, uint64_t seed)
{
    struct ggn_study_person p = {.seed = seed, .created = "2024-01-01T00:00:00Z"};
    struct base_err err = {0};
    snprintf(p.id, sizeof p.id, "%s", id);
    assert_int_equal(ggn_study_token(p.key, 32, &err), 0);
    assert_int_equal(ggn_study_store_add_person(store, &p, "{\"answers\":{\"vision\":\"well\"}}", &err), 0);
    assert_int_equal(ggn_study_store_find(store, p.key, NULL, &p, &err), 1);
    return p.row;
}

static void trials_are_added_and_never_changed(void **state)
{
    struct ggn_study_store *store = open_store(NULL);
    struct ggn_study_trial t = {.slot = 3, .level = 64, .answer = 1, .ms = 12.5, .at = "now"}, *trials;
    struct base_err err = {0};
    int64_t row = add_person(store, "00000001", 5), other = add_person(store, "00000002", 6);
    int n, count;
    (void)state;
    assert_int_equal(ggn_study_store_add_trial(store, row, &t, &err), 1);
    assert_int_equal(ggn_study_store_add_trial(store, row, &t, &err), 0);
    t.answer = 2;
    assert_int_equal(ggn_study_store_add_trial(store, row, &t, &err), BASE_EINVAL);
    t.revision = 1;
    assert_int_equal(ggn_study_store_add_trial(store, row, &t, &err), 1);
    t.slot = 0;
    assert_int_equal(ggn_study_store_add_trial(store, other, &t, &err), 1);
    assert_int_equal(ggn_study_store_trials(store, row, &trials, &n, &err), 0);
    assert_true(n == 2 && trials[0].answer == 1 && trials[1].answer == 2 && trials[0].ms == 12.5);
    free(trials);
    assert_int_equal(ggn_study_store_count(store, row, &count, &err), 0);
    assert_int_equal(count, 1);
    assert_int_equal(ggn_study_store_revisions(store, row, 3, &count, &err), 0);
    assert_int_equal(count, 2);
    assert_int_equal(ggn_study_store_delete(store, row, &err), 0);
    assert_int_equal(ggn_study_store_trials(store, row, &trials, &n, &err), 0);
    assert_int_equal(n, 0);
    assert_int_equal(ggn_study_store_trials(store, other, &trials, &n, &err), 0);
    assert_int_equal(n, 1);
    free(trials);
    ggn_study_store_close(store);
}

static void a_deleted_person_leaves_no_bytes(void **state)
{
    char dir[] = "/tmp/ggn_study_XXXXXX", path[4096], *bytes;
    struct ggn_study_person p = {.id = "0000000a", .key = ID, .created = "2024"};
    struct base_err err = {0};
    size_t size;
    (void)state;
    assert_non_null(mkdtemp(dir));
    struct ggn_study_store *store = open_store(dir);
    assert_int_equal(ggn_study_store_add_person(store, &p, "{\"secret\":\"XYZZYPLUGH\"}", &err), 0);
    assert_int_equal(ggn_study_store_find(store, NULL, "0000000a", &p, &err), 1);
    assert_int_equal(ggn_study_store_delete(store, p.row, &err), 0);
    ggn_study_store_close(store);
    snprintf(path, sizeof path, "%s/study.db", dir);
    assert_int_equal(base_file_read(path, 1 << 24, &bytes, &size, &err), 0);
    for (size_t i = 0; i + 10 <= size; i++)
        assert_memory_not_equal(bytes + i, "XYZZYPLUGH", 10);
    free(bytes);
    assert_int_equal(ggn_study_store_open(dir, "fedcba9876543210fedcba9876543210", 0, &store, &err), BASE_EINVAL);
    unlink(path);
    rmdir(dir);
}

static void what_is_exported_can_be_imported(void **state)
{
    char dir[] = "/tmp/ggn_study_XXXXXX", first[64], second[64], *a, *b;
    struct ggn_study s;
    struct base_err err = {0};
    struct ggn_study_store *from = open_store(NULL), *to = open_store(NULL);
    size_t na, nb;
    int n = 0;
    (void)state;
    assert_non_null(mkdtemp(dir));
    snprintf(first, sizeof first, "%s/a.json", dir);
    snprintf(second, sizeof second, "%s/b.json", dir);
    parse("2ifc", &s);
    for (int person = 0; person < 3; person++) {
        char id[] = "0000000a";
        id[7] = (char)(id[7] + person);
        struct ggn_study_plan plan;
        uint64_t seed = ggn_study_person_seed(&s, (uint64_t)person);
        int64_t row = add_person(from, id, seed);
        assert_int_equal(ggn_study_plan_init(&plan, &s, seed, &err), 0);
        for (int slot = 0; slot < 10 * person; slot++) {
            const struct ggn_study_trial t = {.slot = slot,
                                              .level = plan.slots[slot].catch_trial ? 0 : 64,
                                              .answer = 1 + slot % 2,
                                              .ms = 0.1 * slot,
                                              .at = "2024-01-01T00:00:00Z"};
            assert_int_equal(ggn_study_store_add_trial(from, row, &t, &err), 1);
        }
        ggn_study_plan_release(&plan);
    }
    assert_int_equal(ggn_study_export(&s, from, first, &n, &err), 0);
    assert_int_equal(n, 3);
    assert_int_equal(ggn_study_import(&s, to, first, &n, &err), 0);
    assert_int_equal(ggn_study_export(&s, to, second, &n, &err), 0);
    assert_int_equal(base_file_read(first, 1 << 24, &a, &na, &err) | base_file_read(second, 1 << 24, &b, &nb, &err), 0);
    assert_int_equal(na, nb);
    assert_memory_equal(a, b, na);
    assert_null(strstr(a, "key"));
    assert_int_equal(ggn_study_import(&s, to, first, &n, &err), BASE_EINVAL); /* they are there already: nobody twice */
    char *level = strstr(a, "\"level\":\t64");
    level[9] = '9';
    assert_int_equal(base_file_write_line(first, a, &err), 0);
    ggn_study_store_close(to);
    to = open_store(NULL);
    assert_int_equal(ggn_study_import(&s, to, first, &n, &err),
                     BASE_EINVAL); /* a level that the study has not: nobody at all */
    struct ggn_study_person *people = NULL;
    assert_int_equal(ggn_study_store_people(to, &people, &n, &err), 0);
    assert_int_equal(n, 0);
    free(people);
    free(a);
    free(b);
    unlink(first);
    unlink(second);
    rmdir(dir);
    ggn_study_release(&s);
    ggn_study_store_close(from);
    ggn_study_store_close(to);
}

static void addresses_are_numbers(void **state)
{
    static const struct {
        const char *text, *host;
        int port, ipv6, loopback;
    } good[] = {{"127.0.0.1", "127.0.0.1", GGN_STUDY_PORT, 0, 1},
                {"127.8.9.1:80", "127.8.9.1", 80, 0, 1},
                {"0.0.0.0:0", "0.0.0.0", 0, 0, 0},
                {"192.168.1.5:8080", "192.168.1.5", 8080, 0, 0},
                {"[::1]", "::1", GGN_STUDY_PORT, 1, 1},
                {"[::]:81", "::", 81, 1, 0}};
    static const char *const bad[] = {"",     "localhost", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000", "127.0.0.1:-1",
                                      "[::1", "[::1]x",    "::1",        "1.2.3"};
    struct ggn_study_address a;
    struct base_err err = {0};
    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(ggn_study_address_parse(good[i].text, &a, &err), 0);
        assert_string_equal(a.host, good[i].host);
        assert_true(a.port == good[i].port && a.ipv6 == good[i].ipv6 && a.loopback == good[i].loopback);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (ggn_study_address_parse(bad[i], &a, &err) != BASE_EINVAL)
            fail_msg("'%s' was taken", bad[i]);
    static const char *const told[][2] = {
        {"localhost", "--listen localhost: not an address in numbers, like 127.0.0.1 or [::1]"},
        {"[::1", "--listen [::1: expected ADDRESS, ADDRESS:PORT or [ADDRESS6]:PORT"},
        {"127.0.0.1:65536", "--listen 127.0.0.1:65536: a port is 0 … 65535"},
        {"127.0.0.1:1x", "--listen 127.0.0.1:1x: a port is 0 … 65535"}};
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++) {
        assert_int_equal(ggn_study_address_parse(told[i][0], &a, &err), BASE_EINVAL);
        assert_string_equal(err.text, told[i][1]);
    }
    assert_int_equal(ggn_study_address_parse("127.0.0.1:65535", &a, &err), 0);
    assert_int_equal(a.port, 65535);
    assert_int_equal(ggn_study_address_parse("126.0.0.1", &a, &err), 0);
    assert_int_equal(a.loopback, 0);
}

/* Hex digits that nobody guesses, and the same only when all of them are. */
static void tokens(void **state)
{
    char a[33], b[33];
    struct base_err err = {0};
    int seen[16] = {0}, different = 0;
    (void)state;
    for (int i = 0; i < 8; i++) {
        assert_int_equal(ggn_study_token(a, 32, &err) | ggn_study_token(b, 32, &err), 0);
        assert_true(strlen(a) == 32 && strspn(a, "0123456789abcdef") == 32 && !ggn_study_token_equal(a, b));
        for (int k = 0; k < 32; k++)
            seen[strchr("0123456789abcdef", a[k]) - "0123456789abcdef"]++;
        for (int k = 0; k < 32; k += 2)
            different += a[k] != a[k + 1];
    }
    assert_true(different > 64); /* of 128 pairs; the two halves of a byte are two digits */
    for (int i = 0; i < 16; i++)
        assert_true(seen[i] > 0); /* missing with a chance of 1e-6 */
    assert_int_equal(ggn_study_token(a, 7, &err), 0);
    assert_int_equal(strlen(a), 7);
    assert_true(ggn_study_token_equal("abc", "abc") && ggn_study_token_equal("", ""));
    assert_true(!ggn_study_token_equal("abc", "abd") && !ggn_study_token_equal("abc", "bbc") &&
                !ggn_study_token_equal("abc", "ab") && !ggn_study_token_equal("ab", "abc"));
    assert_true(!ggn_study_token_equal("ab", "ba")); /* differences do not cancel */
}

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
        cmocka_unit_test(a_study_comes_back_as_it_was_written),
        cmocka_unit_test(a_bad_study_is_refused),
        cmocka_unit_test(two_intervals_are_balanced),
        cmocka_unit_test(a_plan_depends_on_the_seed_alone),
        cmocka_unit_test(validation_and_adjustment_show_everything),
        cmocka_unit_test(trials_are_added_and_never_changed),
        cmocka_unit_test(a_deleted_person_leaves_no_bytes),
        cmocka_unit_test(what_is_exported_can_be_imported),
        cmocka_unit_test(addresses_are_numbers),
        cmocka_unit_test(tokens),
        cmocka_unit_test(plans_are_as_they_were),
        cmocka_unit_test(studies_are_refused_in_these_words),
        cmocka_unit_test(trials_are_answered_word_by_word),
        cmocka_unit_test(turns_are_kept),
        cmocka_unit_test(requests_are_answered_word_by_word),
        cmocka_unit_test(imports_are_answered_word_by_word),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
