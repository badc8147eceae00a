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
#include "support/ggn_study_made.h"

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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
