/* What people.c makes of stored trials: who was right, who answered faster than anybody can look, and who counts. Every expected
 * figure is counted here, from the plan and the answers alone. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "study/people.h"
#include "study/status.h"

#define ID "0123456789abcdef0123456789abcdef"
#define NEAR(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

enum { TRIALS = 40, LEVELS = 9, MIN_MS = 200 };

/* One view of two blocks; the levels are 2^4 … 2^12. */
static void make_study(struct ggn_study *s, const char *task)
{
    char text[2048];
    struct base_err err = {0};
    snprintf(text, sizeof text,
             "{\"format\":\"lull-study\",\"version\":1,\"id\":\"" ID "\",\"task\":\"%s\",\"seed\":7,\"trials\":%d,"
             "\"repeats\":10,\"catch_share\":0.1,\"show_ms\":700,\"gap_ms\":400,\"break_every\":0,\"min_catch_passed\":0.75,"
             "\"max_untouched\":0.5,\"min_ms\":%d,\"max_fast\":0.1,\"conditions\":[\"a\",\"b\"],"
             "\"views\":[{\"name\":\"v\",\"width\":20,\"height\":10,\"blocks\":["
             "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":10,\"y1\":10,\"levels\":[16,32,64,128,256,512,1024,2048,4096]},"
             "{\"id\":1,\"x0\":10,\"y0\":0,\"x1\":20,\"y1\":10,\"levels\":[16,32,64,128,256,512,1024,2048,4096]}]}]}",
             task, TRIALS, MIN_MS);
    assert_int_equal(ggn_study_parse("test", text, strlen(text), s, &err), 0);
}

/* The answer to a slot, and how long it took; the k-th of its block. */
typedef void answer_fn(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t);

/* A person that answers the whole plan so. */
static void add_person(const struct ggn_study *s, struct ggn_study_store *store, int number, answer_fn *answer)
{
    struct ggn_study_person p = {.seed = ggn_study_person_seed(s, (uint64_t)number), .created = "2024-01-01T00:00:00Z"};
    struct ggn_study_plan plan;
    struct base_err err = {0};
    int of_block[2] = {0};
    snprintf(p.id, sizeof p.id, "%08x", (unsigned)number);
    snprintf(p.key, sizeof p.key, "%032x", (unsigned)number);
    assert_int_equal(ggn_study_store_add_person(store, &p, "{}", &err), 0);
    assert_int_equal(ggn_study_store_find(store, p.key, NULL, &p, &err), 1);
    assert_int_equal(ggn_study_plan_init(&plan, s, p.seed, &err), 0);
    for (int i = 0; i < plan.n; i++) {
        struct ggn_study_trial t = {.slot = i, .ms = 1000.0};
        snprintf(t.at, sizeof t.at, "2024-01-01T00:%02d:%02dZ", i / 60, i % 60);
        answer(&plan.slots[i], i, of_block[plan.slots[i].block]++, &t);
        assert_int_equal(ggn_study_store_add_trial(store, p.row, &t, &err), 1);
    }
    ggn_study_plan_release(&plan);
}

static void read_people(struct ggn_study_people *p, const struct ggn_study *s, struct ggn_study_store *store)
{
    struct base_err err = {0};
    struct base_threads *threads = base_threads_create(1, &err);
    assert_non_null(threads);
    assert_int_equal(ggn_study_people_init(p, s, store, threads, &err), 0);
    assert_int_equal(ggn_study_people_estimate(p, threads, &err), 0);
    base_threads_destroy(threads);
}

static struct ggn_study_store *open_store(void)
{
    struct ggn_study_store *store = NULL;
    struct base_err err = {0};
    assert_int_equal(ggn_study_store_open(NULL, ID, 1, &store, &err), 0);
    return store;
}

/* --- who was right --- */

static uint32_t level_of(const struct ggn_study_slot *slot, int k) { return slot->catch_trial ? 0 : 16u << k % LEVELS; }

static int noisy(const struct ggn_study_slot *slot) /* the interval, from 1 */ { return slot->side == 0 ? 1 : 2; }

/* Sees the noise below 2^8 samples and nothing above: there, and for 256 itself, says "first" whatever is shown. */
static void answer_by_sight(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    (void)i;
    t->level = level_of(slot, k);
    t->answer = t->level < 256 ? noisy(slot) : 1;
}

static void answer_the_clean_one(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    (void)i;
    t->level = level_of(slot, k);
    t->answer = 3 - noisy(slot);
}

static void answer_right(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    (void)i;
    t->level = level_of(slot, k);
    t->answer = noisy(slot);
}

static void an_answer_is_right_when_it_names_the_noisy_interval(void **state)
{
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    (void)state;
    make_study(&s, "2ifc");
    add_person(&s, store, 0, answer_right);
    add_person(&s, store, 1, answer_the_clean_one);
    add_person(&s, store, 2, answer_by_sight);
    read_people(&p, &s, store);
    const struct ggn_study_result *right = &p.results[0], *wrong = &p.results[1], *by_sight = &p.results[2];
    for (int i = 0; i < 3; i++) {
        int plain = 0, first = 0, correct = 0;
        assert_int_equal(p.results[i].n_choices, 2 * TRIALS);
        for (int c = 0; c < p.results[i].n_choices; c++) {
            plain += p.results[i].choices[c].x == GGN_STUDY_PLAIN;
            first += p.results[i].choices[c].first;
            correct += p.results[i].choices[c].correct;
        }
        assert_int_equal(plain, 2 * TRIALS / 10);
        assert_int_equal(p.results[i].catch_total, 2 * TRIALS / 10);
        assert_int_equal(first, TRIALS); /* half of all, by the plan */
        if (i < 2)
            assert_int_equal(correct, i == 0 ? 2 * TRIALS : 0);
    }
    assert_true(right->catch_passed == right->catch_total && *right->excluded == '\0');
    assert_int_equal(wrong->catch_passed, 0);
    assert_string_equal(wrong->excluded, "0 of 8 catch trials passed");
    assert_true(by_sight->catch_passed == by_sight->catch_total && *by_sight->excluded == '\0');
    for (int c = 0; c < by_sight->n_choices; c++) { /* blind answers are right when the noise came first */
        const struct ggn_study_choice *choice = &by_sight->choices[c];
        assert_int_equal(choice->correct, choice->x < 8.0 || choice->first);
    }
    for (int b = 0; b < 2; b++) {
        assert_true(right->cells[b].t > 12.0); /* seen at every level, up to 2^12 */
        assert_true(wrong->cells[b].t < 4.0);  /* never better than guessing */
        NEAR(by_sight->cells[b].t, 7.5, 0.6);  /* between the last that is seen, 2^7, and the first that is not */
    }
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

/* Same for reference against reference and for condition a, different for heavy noise and for b. */
static void judge(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    (void)i;
    (void)k;
    t->answer = slot->catch_trial == GGN_STUDY_CATCH_IDENTICAL || (!slot->catch_trial && slot->condition == 0);
    t->rating = t->answer ? 5 : 2;
}

static void judge_all_the_same(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    judge(slot, i, k, t);
    t->answer = 1;
}

static void catch_trials_of_a_validation_have_two_sides(void **state)
{
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    (void)state;
    make_study(&s, "validation");
    add_person(&s, store, 0, judge);
    add_person(&s, store, 1, judge_all_the_same);
    read_people(&p, &s, store);
    assert_int_equal(p.results[0].catch_total, 2); /* of 20 judgements: one of each kind */
    assert_int_equal(p.results[0].catch_passed, 2);
    assert_int_equal(p.results[1].catch_passed, 1);
    assert_string_equal(p.results[1].excluded, "1 of 2 catch trials passed");
    for (int j = 0; j < p.results[0].n_judgements; j++) {
        const struct ggn_study_judgement *found = &p.results[0].judgements[j];
        assert_true(found->condition < 0 ||
                    (found->same == (found->condition == 0) && found->rating == (found->same ? 5 : 2)));
    }
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

/* --- faster than a person can look --- */

static int hurried; /* so many of the first answers are too fast, by a hair */

static void hurry(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    answer_right(slot, i, k, t);
    t->ms = i < hurried ? MIN_MS - 0.5 : MIN_MS;
    if (i < hurried && !slot->catch_trial)
        t->answer = 3 - t->answer; /* a fast answer that entered an estimate would be seen in it */
}

static void fast_answers_are_counted_and_left_out(void **state)
{
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    int all = 2 * TRIALS, limit = all / 10;
    (void)state;
    make_study(&s, "2ifc");
    for (int person = 0; person < 3; person++) {
        hurried = person == 0 ? 0 : limit + person - 1;
        add_person(&s, store, person, hurry);
    }
    read_people(&p, &s, store);
    for (int person = 0; person < 3; person++) {
        const struct ggn_study_result *r = &p.results[person];
        int fast = person == 0 ? 0 : limit + person - 1;
        assert_int_equal(r->fast, fast);
        assert_int_equal(r->done, all);
        assert_int_equal(r->n_choices, all - fast);
        assert_int_equal(r->catch_total, all / 10); /* caught in a hurry, too */
        for (int c = 0; c < r->n_choices; c++)
            assert_int_equal(r->choices[c].correct, 1);
        NEAR(r->median_s, MIN_MS / 1000.0, 1e-12);
        assert_string_equal(r->last, "2024-01-01T00:01:19Z");
    }
    assert_string_equal(p.results[0].excluded, "");
    assert_string_equal(p.results[1].excluded, ""); /* a tenth is let pass */
    assert_string_equal(p.results[2].excluded, "9 of 80 answers in less than 200 ms");
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

/* 2^6 in block 0 and 2^9 in block 1; the first setting of all is of another world, and fast. */
static void set(const struct ggn_study_slot *slot, int i, int k, struct ggn_study_trial *t)
{
    (void)k;
    t->level = i == 0 ? 4096 : slot->block ? 512 : 64;
    t->ms = i == 0 ? 1.0 : 2000.0;
}

static void fast_settings_and_judgements_are_left_out_too(void **state)
{
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    (void)state;
    make_study(&s, "adjustment");
    add_person(&s, store, 0, set);
    read_people(&p, &s, store);
    NEAR(p.results[0].cells[0].t, 6.0, 1e-12);
    NEAR(p.results[0].cells[1].t, 9.0, 1e-12);
    assert_int_equal(p.results[0].cells[0].trials + p.results[0].cells[1].trials, 19);
    assert_true(p.results[0].fast == 1 && p.results[0].settings == 20 && *p.results[0].excluded == '\0');
    ggn_study_people_release(&p);
    ggn_study_release(&s);
    ggn_study_store_close(store);
    store = open_store();
    make_study(&s, "validation");
    s.min_ms = 1000.5;
    add_person(&s, store, 0, judge);
    read_people(&p, &s, store);
    assert_true(p.results[0].n_judgements == 0 && p.results[0].fast == 22 && p.results[0].catch_total == 2);
    assert_string_equal(p.results[0].excluded, "22 of 22 answers in less than 1000.5 ms");
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

static void a_study_without_the_rule_keeps_every_answer(void **state)
{
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    (void)state;
    make_study(&s, "2ifc");
    char *text = ggn_study_print(&s), *rule = strstr(text, "\"min_ms\""), *after = strstr(text, "\"views\"");
    assert_true(rule && after && rule < after);
    memmove(rule, after, strlen(after) + 1);
    ggn_study_release(&s);
    assert_int_equal(ggn_study_parse("test", text, strlen(text), &s, NULL), 0);
    free(text);
    assert_true(s.min_ms == 0.0 && s.max_fast == 1.0 && *s.asked_by == '\0');
    hurried = 2 * TRIALS;
    add_person(&s, store, 0, hurry);
    read_people(&p, &s, store);
    assert_true(p.results[0].fast == 0 && p.results[0].n_choices == 2 * TRIALS && *p.results[0].excluded == '\0');
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

/* --- where a study stands --- */

static void the_status_has_a_line_for_everybody(void **state)
{
    char *text = NULL;
    size_t size = 0;
    struct ggn_study s;
    struct ggn_study_people p;
    struct ggn_study_store *store = open_store();
    FILE *f = open_memstream(&text, &size);
    (void)state;
    assert_non_null(f);
    make_study(&s, "2ifc");
    read_people(&p, &s, store);
    ggn_study_status(f, &p);
    ggn_study_people_release(&p);
    add_person(&s, store, 0, answer_right);
    hurried = 9;
    add_person(&s, store, 1, hurry);
    read_people(&p, &s, store);
    p.results[0].done = 12; /* as if they had gone away */
    ggn_study_status(f, &p);
    assert_int_equal(fclose(f), 0);
    assert_string_equal(text,
                        "2ifc: 0 people, 0 finished, 0 under way, 0 without an answer\n"
                        "2ifc: 2 people, 1 finished, 1 under way, 0 without an answer; last answer 2024-01-01T00:01:19Z\n"
                        "person          done    catch  median s  fast  minutes  last answer\n"
                        "00000000       12/80      8/8       1.0     0      1.3  2024-01-01T00:01:19Z\n"
                        "00000001       80/80      8/8       0.2     9      0.3  2024-01-01T00:01:19Z"
                        "  does not count: 9 of 80 answers in less than 200 ms\n");
    free(text);
    ggn_study_people_release(&p);
    ggn_study_store_close(store);
    ggn_study_release(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_answer_is_right_when_it_names_the_noisy_interval),
        cmocka_unit_test(catch_trials_of_a_validation_have_two_sides),
        cmocka_unit_test(fast_answers_are_counted_and_left_out),
        cmocka_unit_test(fast_settings_and_judgements_are_left_out_too),
        cmocka_unit_test(a_study_without_the_rule_keeps_every_answer),
        cmocka_unit_test(the_status_has_a_line_for_everybody),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
