/* The processes of a job: farms, whoever is late; who differs, ends early, is silent or dead is named. The processes
 * are threads of the test. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <pthread.h>
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

#include "base/threads.h"
#include "job/farm.h"
#include "job/message.h"
#include "support/base_transport.h"

struct seat {
    struct job *job;
    struct base_err err;
    void (*work)(struct seat *seat);
    int rc, status;
    const char *said; /* last words */
    pthread_t thread;
};

static void *sit(void *data)
{
    struct seat *s = data;
    s->work(s);
    s->status = job_close(s->job, s->rc ? 2 : 0, s->said ? s->said : s->err.text, &s->err);
    return NULL;
}

/* `count` processes do the same and close; what they left is in seats. Returns how often the job was aborted. */
static int together(struct seat *seats, int count, void (*work)(struct seat *seat), double timeout_s)
{
    struct base_transport *transport = base_transport_create(count);
    assert_non_null(transport);
    for (int r = 0; r < count; r++) {
        seats[r] = (struct seat){.work = work};
        assert_int_equal(job_create(base_transport_of(transport, r), &seats[r].job, &seats[r].err), 0);
        job_watch(seats[r].job, timeout_s, NULL);
    }
    for (int r = 0; r < count; r++)
        assert_int_equal(pthread_create(&seats[r].thread, NULL, sit, &seats[r]), 0);
    for (int r = 0; r < count; r++)
        pthread_join(seats[r].thread, NULL);
    int aborted = base_transport_aborted(transport);
    base_transport_destroy(transport);
    return aborted;
}

static void all_well(const struct seat *seats, int count)
{
    for (int r = 0; r < count; r++)
        if (seats[r].rc || seats[r].status)
            fail_msg("rank %d of %d: %d, %s", r, count, seats[r].rc, seats[r].err.text);
}

static void nap(int ms) { nanosleep(&(struct timespec){.tv_nsec = ms * 1000000L}, NULL); }

static void nobody_else_is_a_job_too(void **state)
{
    struct base_err err = {0};
    assert_int_equal(job_handshake(NULL, "a=1\n", 1, &err), 0);
    assert_int_equal(job_close(NULL, 5, "", &err), 5);
    (void)state;
}

/* --- farms --------------------------------------------------------------------------------------------------------------- */

enum { ITEMS = 1000 };

struct field {
    atomic_int done[ITEMS]; /* how often; by any process */
    int whole, apply_rc, fail_at;
    atomic_int answered; /* an answer of a worker was applied */
};
static struct field field;

struct crop {
    uint64_t square[ITEMS];
    struct base_threads *threads;
};

static void pack(void *data, uint32_t i, void *item)
{
    (void)data;
    *(uint64_t *)item = i;
}

static int here(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    struct crop *c = data;
    (void)thread;
    for (uint32_t i = first; i < first + n; i++) {
        if ((int)i == field.fail_at)
            return base_fail(err, BASE_EINVAL, "item %u is bad", i);
        atomic_fetch_add(&field.done[i], 1);
        c->square[i] = (uint64_t)i * i;
    }
    return 0;
}

/* Slow until a worker has answered: twenty seconds for all items. It is this thread, too, that takes the answers. */
static int here_after_an_answer(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    for (int ms = 0; ms < 20 && !field.answered; ms++)
        nap(1);
    return here(data, first, n, thread, err);
}

static int work(void *data, struct job_task *task, uint32_t k, uint32_t n, void *answer, int thread, struct base_err *err)
{
    const uint64_t *common = job_task_common(task);
    int rc = here(data, task->first + k, n, thread, err);
    for (uint32_t j = 0; j < n && !rc; j++) {
        const uint64_t i = *(uint64_t *)job_task_item(task, k + j);
        ((uint64_t *)answer)[j] = i * i + *common;
    }
    if (!task->whole != (n == 1 || task->count == 1) && task->count > 1)
        return base_fail(err, BASE_EINVAL, "%u items at once", n);
    return rc;
}

static int apply(void *data, uint32_t i, const void *answer)
{
    struct crop *c = data;
    field.answered = 1;
    c->square[i] = *(const uint64_t *)answer - 5;
    return field.apply_rc;
}

static void farm_twice(struct seat *s)
{
    struct crop *c = calloc(1, sizeof *c);
    const uint64_t common = 5;
    struct job_farm farm = {.whole = field.whole,
                            .count = ITEMS,
                            .common_bytes = sizeof common,
                            .item_bytes = 8,
                            .answer_bytes = 8,
                            .common = &common,
                            .pack = pack,
                            .here = field.apply_rc ? here_after_an_answer : here,
                            .apply = apply,
                            .data = c};
    const struct job_service service = {work, c};
    c->threads = base_threads_create(2, &s->err);
    s->rc = job_handshake(s->job, "a=1\n", 2, &s->err);
    for (int round = 0; round < 2 && !s->rc; round++) {
        farm.count = round == 0 ? ITEMS : 1;
        s->rc = job_share(s->job, c->threads, &farm, &service, &s->err);
        for (uint64_t i = 0; i < farm.count && !s->rc && job_rank(s->job) == 0; i++)
            s->rc = c->square[i] != i * i;
    }
    const struct job_traffic t = job_traffic(s->job);
    if (!s->rc && s->job)
        s->rc = t.messages < 2 || t.bytes < 2 * sizeof(struct job_message) || !(t.waiting_s >= 0);
    base_threads_destroy(c->threads);
    free(c);
}

static void a_farm_does_every_item_once(void **state)
{
    (void)state;
    for (int count = 2; count <= 8; count += 3)
        for (int whole = 0; whole < 2; whole++) {
            struct seat seats[BASE_TRANSPORT_MAX];
            memset(&field, 0, sizeof field);
            field.whole = whole;
            field.fail_at = -1;
            assert_int_equal(together(seats, count, farm_twice, 0), 0);
            all_well(seats, count);
            for (int i = 0; i < ITEMS; i++)
                assert_int_equal(field.done[i], i == 0 ? 2 : 1); /* the second farm has one item */
        }
    struct seat alone = {0};
    farm_twice(&alone);
    assert_int_equal(alone.rc, 0);
}

static void a_bad_item_ends_the_farm(void **state)
{
    (void)state;
    for (int whole = 0; whole < 2; whole++) {
        struct seat seats[3];
        memset(&field, 0, sizeof field);
        field.whole = whole;
        field.fail_at = 500;
        together(seats, 3, farm_twice, 0);
        assert_int_equal(seats[0].status, 2);
        assert_non_null(strstr(seats[0].err.text, "item 500 is bad")); /* here, or of the worker that had it */
    }
}

static void an_answer_that_is_refused_names_who_gave_it(void **state)
{
    (void)state;
    struct seat seats[2];
    memset(&field, 0, sizeof field);
    field.fail_at = -1;
    field.apply_rc = 1;
    together(seats, 2, farm_twice, 0);
    assert_string_equal(seats[0].err.text, "rank 1 on host here said something that makes no sense");
}

/* --- who is not as the others ------------------------------------------------------------------------------------------- */

static const char *settings_of[2]; /* of rank 0; of the last rank */

static void shake(struct seat *s)
{
    const int last = job_rank(s->job) == job_count(s->job) - 1;
    s->rc = job_handshake(s->job, settings_of[last], 3, &s->err);
    if (job_rank(s->job) == 0 && !s->rc)
        s->rc = job_worker_threads(s->job) != 3 * (job_count(s->job) - 1);
}

static void who_differs_is_named_with_the_line(void **state)
{
    (void)state;
    static const char *const cases[][3] = {
        {"a=1\nb=2\nc=4\n", "a=1\nb=3\nc=5\n",
         "rank 2 on host here has b=3, but rank 0 has b=2: give all hosts the same files"},
        {"a=1\nb=3", "a=1\nbc=3", "rank 2 on host here has bc=3, but rank 0 has no bc: give all hosts the same files"},
        {"a=1\n", "a=1\nb=3\n", "rank 2 on host here has b=3, but rank 0 has no b: give all hosts the same files"}};
    struct seat seats[3];
    for (int i = 0; i < 3; i++) {
        settings_of[0] = cases[i][0];
        settings_of[1] = cases[i][1];
        assert_int_equal(together(seats, 3, shake, 0), 0);
        assert_int_equal(seats[0].status, 2);
        assert_string_equal(seats[0].err.text, cases[i][2]);
    }
    settings_of[0] = settings_of[1] = "a=1\n";
    together(seats, 3, shake, 0);
    all_well(seats, 3);
}

/* Rank 1 sends its farewell, rank 2 something else, in the place of a hello. */
static int greeting;

static void greet_wrong(struct seat *s)
{
    if (job_rank(s->job) == 1 && greeting == 0) {
        s->rc = 1;
        s->said = "no such file";
    } else if (job_rank(s->job) == 2 && greeting == 1) {
        job_send_head(s->job, 0, JOB_ANSWER, 1);
    } else if (job_rank(s->job) != 1 || greeting != 2) {
        s->rc = job_handshake(s->job, "a=1\n", 1, &s->err);
    }
}

static void who_does_not_say_hello_is_named(void **state)
{
    (void)state;
    static const char *const words[] = {"rank 1 on host here: no such file",
                                        "rank 2 on host here said something that makes no sense",
                                        "rank 1 on host here: ended too early"};
    for (greeting = 0; greeting < 3; greeting++) {
        struct seat seats[3];
        together(seats, 3, greet_wrong, 0);
        assert_int_equal(seats[0].status, 2);
        assert_string_equal(seats[0].err.text, words[greeting]);
    }
}

static void fail_after_work(struct seat *s)
{
    nap(job_rank(s->job) == 2 ? 20 : 1);
    s->rc = job_rank(s->job) == 2;
    s->said = s->rc ? "disk full" : NULL;
}

static void the_job_has_the_status_of_who_failed(void **state)
{
    struct seat seats[3];
    assert_int_equal(together(seats, 3, fail_after_work, 0), 0);
    assert_int_equal(seats[0].status, 2);
    assert_int_equal(seats[1].status, 0);
    assert_int_equal(seats[2].status, 0); /* who failed leaves it to rank 0 to say so */
    assert_string_equal(seats[0].err.text, "disk full");
    (void)state;
}

/* Rank 1 never comes. */
static void wait_for_all(struct seat *s) { s->rc = job_handshake(s->job, "a=1\n", 1, &s->err); }

static void who_is_silent_is_given_up(void **state)
{
    (void)state;
    struct base_transport *transport = base_transport_create(3);
    struct seat seats[3] = {{.work = wait_for_all}, {0}, {.work = wait_for_all}};
    for (int r = 0; r < 3; r += 2) {
        assert_int_equal(job_create(base_transport_of(transport, r), &seats[r].job, NULL), 0);
        job_watch(seats[r].job, 0.2, NULL);
        assert_int_equal(pthread_create(&seats[r].thread, NULL, sit, &seats[r]), 0);
    }
    pthread_join(seats[0].thread, NULL);
    assert_int_equal(seats[0].rc, BASE_EIO);
    assert_string_equal(seats[0].err.text, "rank 1 on host here has not answered for 0.2 s (--rank-timeout)");
    assert_int_equal(base_transport_aborted(transport), 1);
    struct job_message *end = malloc(sizeof *end); /* what an abort does, so that rank 2 comes home */
    *end = (struct job_message){JOB_END, 2};
    struct job_transport *t = base_transport_of(transport, 0);
    t->calls->send(t, 2, end, sizeof *end, NULL);
    pthread_join(seats[2].thread, NULL);
    assert_int_equal(seats[2].rc, 0);
    base_transport_destroy(transport);
}

static void who_is_dead_is_named(void **state)
{
    (void)state;
    struct base_transport *transport = base_transport_create(3);
    struct base_err err = {0};
    struct job *job;
    struct job_process *last = base_transport_process(transport, 2);
    last->pid = 999999999;
    strcpy(last->host, "there");
    assert_int_equal(job_create(base_transport_of(transport, 0), &job, &err), 0);
    long processors = sysconf(_SC_NPROCESSORS_ONLN), share = processors / 2 < 1 ? 1 : processors / 2;
    int available = base_threads_available();
    assert_int_equal(job_threads(NULL), available);
    assert_int_equal(job_threads(job), share < available ? share : available);
    assert_int_equal(job_find_dead(job), 0); /* of other hosts nothing is known */
    strcpy(last->host, "here");
    assert_int_equal(job_find_dead(job), BASE_EIO);
    assert_int_equal(job_failed(job, &err), BASE_EIO);
    assert_string_equal(err.text, "rank 2 on host here has died");
    assert_int_equal(job_close(job, 2, "", &err), 2);
    assert_int_equal(base_transport_aborted(transport), 1);
    base_transport_destroy(transport);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nobody_else_is_a_job_too),
        cmocka_unit_test(a_farm_does_every_item_once),
        cmocka_unit_test(a_bad_item_ends_the_farm),
        cmocka_unit_test(an_answer_that_is_refused_names_who_gave_it),
        cmocka_unit_test(who_differs_is_named_with_the_line),
        cmocka_unit_test(who_does_not_say_hello_is_named),
        cmocka_unit_test(the_job_has_the_status_of_who_failed),
        cmocka_unit_test(who_is_silent_is_given_up),
        cmocka_unit_test(who_is_dead_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
