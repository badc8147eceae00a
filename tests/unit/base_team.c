/* Processes that work in step: whole results in order, whoever is late; who differs, ends early or is silent is named. The
 * processes are threads of the test. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <pthread.h>
#include <time.h>

#include "base/team.h"
#include "support/base_room.h"

enum { ITEMS = 7 };

struct seat {
    struct base_team *team;
    struct base_err err;
    void (*work)(struct seat *seat);
    int rc, status;
    int heard;        /* calls of which rank 0 has all parts */
    const char *said; /* last words */
    pthread_t thread;
};

static void *sit(void *data)
{
    struct seat *s = data;
    s->work(s);
    s->status = base_team_close(s->team, s->rc ? 2 : 0, s->said ? s->said : s->err.text, &s->err);
    return NULL;
}

/* `count` processes do the same and close; what they left is in seats. */
static void together(struct seat *seats, int count, void (*work)(struct seat *seat), double timeout_s)
{
    struct base_room *room = base_room_create(count);
    assert_non_null(room);
    for (int r = 0; r < count; r++) {
        seats[r] = (struct seat){.work = work};
        assert_int_equal(base_team_create(base_room_of(room, r), &seats[r].team, &seats[r].err), 0);
        base_team_watch(seats[r].team, timeout_s, NULL);
    }
    for (int r = 0; r < count; r++)
        assert_int_equal(pthread_create(&seats[r].thread, NULL, sit, &seats[r]), 0);
    for (int r = 0; r < count; r++)
        pthread_join(seats[r].thread, NULL);
    assert_int_equal(base_room_aborted(room), 0);
    base_room_destroy(room);
}

static void nap(int ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL); }

/* Each fills its items; low ranks are late. */
static void share_items(struct seat *s)
{
    const int rank = base_team_rank(s->team), count = base_team_count(s->team);
    const long own = base_team_first(s->team, ITEMS, rank + 1) - base_team_first(s->team, ITEMS, rank);
    s->rc = own > base_team_most(s->team, ITEMS) || own < base_team_most(s->team, ITEMS) - 1;
    for (int round = 0; round < 3 && !s->rc; round++) {
        double items[ITEMS] = {0};
        for (long i = base_team_first(s->team, ITEMS, rank); i < base_team_first(s->team, ITEMS, rank + 1); i++)
            items[i] = (double)(100 * round + i);
        nap(count - rank);
        s->rc = base_team_gather_items(s->team, items, sizeof items[0], ITEMS);
        for (int i = 0; i < ITEMS && !s->rc; i++)
            s->rc = items[i] != (double)(100 * round + i);
    }
}

static void everybody_has_all_items_in_order(void **state)
{
    const int counts[] = {2, 3, 8};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        struct seat seats[BASE_ROOM_MAX];
        together(seats, counts[k], share_items, 0);
        for (int r = 0; r < counts[k]; r++)
            if (seats[r].rc || seats[r].status)
                fail_msg("rank %d of %d: %d, %s", r, counts[k], seats[r].rc, seats[r].err.text);
    }
    (void)state;
}

/* Alone nothing travels. */
static void nobody_else_is_a_team_too(void **state)
{
    double items[ITEMS] = {3};
    struct base_err err = {0};
    assert_int_equal(base_team_first(NULL, 9, 0), 0);
    assert_int_equal(base_team_first(NULL, 9, 1), 9);
    assert_int_equal(base_team_gather_items(NULL, items, sizeof items[0], ITEMS), 0);
    assert_int_equal(base_team_tell(NULL, items, sizeof items), 0);
    assert_int_equal(base_team_agree(NULL, "a=1\n", &err), 0);
    assert_null(base_team_collect(NULL, items, sizeof items));
    assert_int_equal(base_team_close(NULL, 5, "", &err), 5);
    assert_true(items[0] == 3);
    (void)state;
}

static void parts_and_words(struct seat *s)
{
    const int rank = base_team_rank(s->team);
    char mine[8] = "abcdefg";
    int word = rank == 0 ? 42 : 0;
    const struct base_team_part *parts = base_team_collect(s->team, mine, (size_t)rank);
    s->rc = (parts != NULL) != (rank == 0);
    for (int r = 1; parts && r < base_team_count(s->team); r++)
        s->rc |= parts[r].size != (size_t)r || memcmp(parts[r].data, mine, (size_t)r) != 0;
    s->rc |= base_team_tell(s->team, &word, sizeof word) || word != 42;
    s->rc |= base_team_tell(s->team, NULL, 0);
    s->rc |= base_team_traffic(s->team).messages != (rank == 0 ? 9 : 3); /* a part and two tellings, for each of three */
}

static void rank_0_gets_parts_of_any_size_and_is_heard(void **state)
{
    struct seat seats[4];
    together(seats, 4, parts_and_words, 0);
    for (int r = 0; r < 4; r++)
        if (seats[r].rc || seats[r].status)
            fail_msg("rank %d: %d, %s", r, seats[r].rc, seats[r].err.text);
    (void)state;
}

/* What a call of so many bytes from each process adds to the traffic of rank 0: the parts, and a few bytes with each. */
static void counted(struct seat *s)
{
    static char mine[100000];
    struct base_team_traffic before, after;
    for (size_t size = 1000; size <= sizeof mine; size *= 10) {
        before = base_team_traffic(s->team);
        base_team_collect(s->team, mine, size);
        s->rc |= base_team_tell(s->team, mine, size);
        after = base_team_traffic(s->team);
        uint64_t bytes = after.bytes - before.bytes, messages = after.messages - before.messages;
        uint64_t others =
            base_team_rank(s->team) == 0 ? 2 : 1; /* a part comes from or goes to each, and the word likewise */
        s->rc |= messages < 2 * others || messages > 4 * others || bytes < 2 * others * size ||
                 bytes > 2 * others * size + 64 * messages;
        s->rc |= !(after.waiting_s >= before.waiting_s);
    }
}

static void traffic_is_counted_both_ways(void **state)
{
    struct seat seats[3];
    together(seats, 3, counted, 0);
    for (int r = 0; r < 3; r++)
        assert_int_equal(seats[r].rc, 0);
    (void)state;
}

static void agree(struct seat *s)
{
    s->rc = base_team_agree(s->team, base_team_rank(s->team) == 2 ? "a=1\nb=3\n" : "a=1\nb=2\n", &s->err);
}

static void who_differs_is_named_with_the_line(void **state)
{
    struct seat seats[3];
    together(seats, 3, agree, 0);
    assert_int_equal(seats[0].status, 2);
    assert_string_equal(seats[0].err.text, "rank 2 on host here has b=3, but rank 0 has b=2: give all hosts the same files");
    assert_true(seats[1].rc != 0 && seats[2].rc != 0);
    (void)state;
}

/* Rank 2 gives a part where the others are told something. */
static void out_of_step(struct seat *s)
{
    int word = 1;
    base_team_collect(s->team, &word, sizeof word);
    if (base_team_rank(s->team) != 2)
        base_team_tell(s->team, &word, sizeof word);
    else
        nap(20); /* rank 1 has said goodbye by then: it did nothing wrong */
    base_team_collect(s->team, &word, sizeof word);
    s->rc = base_team_failed(s->team, &s->err);
}

/* Rank 2 takes what it is told for something longer. */
static void of_another_length(struct seat *s)
{
    int words[2] = {1, 2};
    s->rc = base_team_tell(s->team, words, base_team_rank(s->team) == 2 ? sizeof words : sizeof words[0]);
    base_team_failed(s->team, &s->err);
}

static void who_is_out_of_step_is_found(void **state)
{
    struct seat seats[3];
    together(seats, 3, out_of_step, 0);
    assert_int_equal(seats[0].status, 2);
    assert_string_equal(seats[0].err.text, "rank 2 on host here said something that makes no sense");
    together(seats, 3, of_another_length, 0);
    assert_int_equal(seats[0].status, 2);
    assert_int_equal(seats[1].rc, 0);
    assert_string_equal(seats[2].err.text, "rank 0 on host here said something that makes no sense");
    (void)state;
}

/* Rank 1 gives its part and goes, which is right the first time; rank 0 hears it while it waits for rank 2. */
static void give_and_go(struct seat *s)
{
    const int rank = base_team_rank(s->team), calls = rank == 1 ? 1 : 2;
    const char letter = (char)('a' + rank);
    for (int i = 0; i < calls && !s->rc; i++) {
        nap(rank == 2 ? 20 : 0);
        const struct base_team_part *parts = base_team_collect(s->team, &letter, 1);
        s->heard += parts && *(char *)parts[1].data == 'b' && *(char *)parts[2].data == 'c';
    }
    s->rc = base_team_failed(s->team, &s->err);
}

static void who_has_given_its_part_may_go(void **state)
{
    struct seat seats[3];
    together(seats, 3, give_and_go, 0);
    assert_int_equal(seats[0].heard, 1);
    assert_int_equal(seats[0].status, 2); /* the second call asks too much */
    assert_string_equal(seats[0].err.text, "rank 1 on host here: ended too early");
    (void)state;
}

static void end_early(struct seat *s)
{
    if (base_team_rank(s->team) == 1) {
        s->rc = 1;
        s->said = "no such file";
        return;
    }
    share_items(s);
    base_team_failed(s->team, &s->err);
}

static void who_ends_early_says_why(void **state)
{
    struct seat seats[3];
    together(seats, 3, end_early, 0);
    assert_int_equal(seats[0].status, 2);
    assert_string_equal(seats[0].err.text, "rank 1 on host here: no such file");
    (void)state;
}

static void fail_after_work(struct seat *s)
{
    nap(base_team_rank(s->team) == 2 ? 20 : 1);
    s->rc = base_team_rank(s->team) == 2;
    s->said = s->rc ? "disk full" : NULL;
}

static void the_job_has_the_status_of_who_failed(void **state)
{
    struct seat seats[3];
    together(seats, 3, fail_after_work, 0);
    assert_int_equal(seats[0].status, 2);
    assert_int_equal(seats[1].status, 0);
    assert_int_equal(seats[2].status, 0); /* who failed leaves it to rank 0 to say so */
    assert_string_equal(seats[0].err.text, "disk full");
    (void)state;
}

static void who_is_silent_is_given_up(void **state)
{
    struct base_room *room = base_room_create(3);
    struct base_team *team = NULL;
    struct base_err err = {0}, unheard = {0};
    int items[3] = {0};
    assert_non_null(room);
    assert_int_equal(base_team_create(base_room_of(room, 0), &team, &err), 0);
    base_team_watch(team, 0.2, NULL);
    assert_int_equal(base_team_gather_items(team, items, sizeof items[0], 3), BASE_EIO);
    double waited_s = base_team_traffic(team).waiting_s;
    assert_true(waited_s > 0.2);
    assert_true(base_room_in_vain(room) <= 6); /* each 0.05 s or more: given up as soon as its time was over */
    assert_int_equal(base_team_gather_items(team, items, sizeof items[0], 3), BASE_EIO); /* for good */
    assert_true(base_team_traffic(team).waiting_s == waited_s);
    base_team_failed(team, &err);
    assert_string_equal(err.text, "rank 1 on host here has not answered for 0.2 s (--rank-timeout)");
    assert_int_equal(base_team_close(team, 2, "", &unheard), 2);
    assert_int_equal(base_room_aborted(room), 1);
    base_room_destroy(room);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(everybody_has_all_items_in_order),
        cmocka_unit_test(nobody_else_is_a_team_too),
        cmocka_unit_test(rank_0_gets_parts_of_any_size_and_is_heard),
        cmocka_unit_test(traffic_is_counted_both_ways),
        cmocka_unit_test(who_differs_is_named_with_the_line),
        cmocka_unit_test(who_is_out_of_step_is_found),
        cmocka_unit_test(who_has_given_its_part_may_go),
        cmocka_unit_test(who_ends_early_says_why),
        cmocka_unit_test(the_job_has_the_status_of_who_failed),
        cmocka_unit_test(who_is_silent_is_given_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
