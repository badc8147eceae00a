/* The crew with threads for processes: the film of one process, and every way in which a member can fail. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <pthread.h>

#include "render/checkpoint.h"
#include "render/crew_member.h"
#include "render/crew_messages.h"
#include "support/pt_fake.h"
#include "support/pt_peers.h"

enum behaviour { WORKS, SILENT, BABBLES, FAILS, OTHER_SETTINGS };

struct member {
    pthread_t thread;
    struct base_peers *peers;
    enum behaviour behaviour;
    int threads;
};

static void send_words(struct base_peers *peers, uint32_t kind, const char *words)
{
    struct base_err err = {0};
    struct pt_crew_hello *hello = calloc(1, sizeof *hello + strlen(words));
    hello->kind = kind;
    memcpy(hello->text, words, strlen(words));
    base_peers_send(peers, 0, hello, sizeof *hello + strlen(words), &err);
}

/* Takes what comes until rank 0 says that it is over; answers the first rows as it is told to. */
static void misbehave(struct member *m)
{
    for (int over = 0, answered = 0; !over;) {
        int rank;
        void *data;
        size_t size;
        struct base_err err = {0};
        if (base_peers_receive(m->peers, 0.05, &rank, &data, &size, &err) <= 0) {
            if (m->behaviour == SILENT && answered)
                return; /* rank 0 gives it up: nobody will say anything any more */
            continue;
        }
        const struct pt_crew_rows *rows = data;
        over = rows->kind == PT_CREW_END;
        if (!over && m->behaviour == BABBLES && !answered)
            send_words(m->peers, PT_CREW_ROWS, "what is this");
        if (!over && m->behaviour == FAILS && !answered)
            send_words(m->peers, PT_CREW_FAILED, "no more paper");
        answered = 1;
        free(data);
    }
    send_words(m->peers, PT_CREW_BYE, "");
}

static void *member_main(void *arg)
{
    struct member *m = arg;
    struct base_err err = {0};
    const struct pt_row_maker maker = {NULL, pt_fake_noise, NULL};
    struct base_threads *threads = base_threads_create(m->threads, &err);
    pt_crew_member_join(m->peers, m->threads, m->behaviour == OTHER_SETTINGS ? "a=1\nb=3\n" : "a=1\nb=2\n", &err);
    if (m->behaviour == WORKS || m->behaviour == OTHER_SETTINGS)
        pt_crew_member_serve(m->peers, threads, &maker, &err);
    else
        misbehave(m);
    base_threads_destroy(threads);
    return NULL;
}

struct stage {
    struct pt_peers_room *room;
    struct member members[PT_PEERS_MAX];
    int count;
    struct pt_crew *crew;
};

static void assemble(struct stage *stage, int count, int threads, enum behaviour last, double timeout_s)
{
    struct base_err err = {0};
    *stage = (struct stage){.room = pt_peers_create(count), .count = count};
    assert_non_null(stage->room);
    for (int i = 1; i < count; i++) {
        stage->members[i] = (struct member){.peers = pt_peers_of(stage->room, i), .threads = threads,
                                            .behaviour = i == count - 1 ? last : WORKS};
        assert_int_equal(pthread_create(&stage->members[i].thread, NULL, member_main, &stage->members[i]), 0);
    }
    assert_int_equal(pt_crew_create(pt_peers_of(stage->room, 0), timeout_s, &stage->crew, &err), 0);
}

/* lost: the crew cannot be sent home, so that the test does it. */
static void part(struct stage *stage, int lost)
{
    pt_crew_dismiss(stage->crew, 2);
    assert_int_equal(pt_peers_aborted(stage->room), lost);
    for (int i = 1; i < stage->count; i++) {
        struct base_err err = {0};
        uint32_t *end = malloc(sizeof *end);
        *end = PT_CREW_END;
        base_peers_send(pt_peers_of(stage->room, 0), i, end, sizeof *end, &err); /* nobody reads it who was dismissed */
        pthread_join(stage->members[i].thread, NULL);
    }
    pt_peers_destroy(stage->room);
}

/* --- same bytes --------------------------------------------------------------------------------------------------------- */

static void assert_same(const struct pt_render *a, const struct pt_render *b)
{
    struct pt_film_array x[PT_FILM_ARRAYS], y[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&a->film, x);
    assert_int_equal(n, pt_film_list_arrays(&b->film, y));
    for (int i = 0; i < n; i++)
        assert_memory_equal(x[i].data, y[i].data, x[i].bytes);
    for (uint32_t i = 0; i < a->blocks.count; i++) {
        const struct pt_block *p = &a->blocks.list[i], *q = &b->blocks.list[i];
        assert_true(p->spp == q->spp && p->reason == q->reason && p->checks == q->checks && p->rays == q->rays);
        assert_true(p->dropped == q->dropped);
        assert_memory_equal(&p->error, &q->error, sizeof p->error);
    }
    assert_true(a->totals.samples == b->totals.samples && a->totals.rays == b->totals.rays);
}

struct run {
    struct pt_render *render;
    struct pt_criterion *criterion;
    struct base_threads *pool;
};

static void release(struct run *r)
{
    pt_render_destroy(r->render);
    pt_criterion_destroy(r->criterion);
    base_threads_destroy(r->pool);
}

static void any_number_of_processes_gives_the_bytes_of_one(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    config.planes = PT_FILM_ALL;
    struct run one = {0};
    assert_int_equal(pt_fake_render(&config, pt_fake_noise, 1, "32", &one.render, &one.criterion, &one.pool), 0);
    const int sizes[][3] = {{2, 1, 1}, {3, 2, 1}, {8, 1, 2}, {5, 3, 3}}; /* processes, their threads, those of rank 0 */
    for (int i = 0; i < 4; i++) {
        struct stage stage;
        struct run many = {0};
        assemble(&stage, sizes[i][0], sizes[i][1], WORKS, 60.0);
        assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
        assert_int_equal(pt_crew_threads(stage.crew), (sizes[i][0] - 1) * sizes[i][1]);
        config.crew = stage.crew;
        config.order_seed = i == 3 ? 99 : 0;
        assert_int_equal(pt_fake_render(&config, pt_fake_noise, sizes[i][2], "32", &many.render, &many.criterion, &many.pool),
                         0);
        assert_same(one.render, many.render);
        assert_true(pt_crew_traffic(stage.crew)->bytes > 0);
        part(&stage, 0);
        release(&many);
    }
    release(&one);
}

/* --- faults ------------------------------------------------------------------------------------------------------------- */

struct watch {
    char line[512];
    const char *checkpoint;
    int left; /* interrupted() says yes from the time that 1 is left; 0: never */
};

static void keep_line(void *data, const char *line)
{
    struct watch *w = data;
    strncpy(w->line, line, sizeof w->line - 1);
}

static int save(void *data, struct pt_render *r, struct base_err *err)
{
    const struct watch *w = data;
    return pt_checkpoint_save(w->checkpoint, r, "settings\n", err);
}

static int count_down(void *data)
{
    struct watch *w = data;
    w->left -= w->left > 1;
    return w->left == 1;
}

/* Renders with a crew until it is lost or interrupted; the checkpoint then goes on alone to the bytes of one process. */
static void ends_well(enum behaviour last, int interrupt_after, const char *words)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    struct watch watch = {.checkpoint = "/tmp/pt_crew_test.ckp", .left = interrupt_after};
    struct run one = {0}, lost = {0}, rest = {0};
    struct stage stage;
    struct lull_pair pair = {"at", "64"};
    assert_int_equal(pt_fake_render(&config, pt_fake_noise, 1, "64", &one.render, &one.criterion, &one.pool), 0);
    for (int turn = 0; turn < 2; turn++) {
        struct run *r = turn == 0 ? &lost : &rest;
        struct pt_render_hooks hooks = {.interrupted = count_down, .suspend = save, .warn = keep_line, .data = &watch};
        struct pt_render_hooks none = {0};
        config.crew = NULL;
        if (turn == 0) {
            assemble(&stage, 3, 1, last, 0.3);
            assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
            config.crew = stage.crew;
        }
        r->pool = base_threads_create(2, &err);
        assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r->pool, NULL, NULL, &r->criterion, &err), 0);
        assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, r->pool, r->criterion, &r->render, &err), 0);
        if (turn == 1)
            assert_int_equal(pt_checkpoint_load(watch.checkpoint, r->render, "settings\n", &err), 0);
        assert_int_equal(pt_render_run(r->render, turn == 0 ? &hooks : &none, &outcome, &err), 0);
        assert_int_equal(outcome, turn == 1 ? PT_RENDER_DONE : words ? PT_RENDER_LOST : PT_RENDER_INTERRUPTED);
        if (turn == 0)
            part(&stage, last == SILENT);
    }
    if (words)
        assert_non_null(strstr(watch.line, words));
    assert_same(one.render, rest.render);
    release(&one);
    release(&lost);
    release(&rest);
    remove(watch.checkpoint);
}

static void a_silent_member_is_named_and_nothing_is_lost(void **state)
{
    (void)state;
    ends_well(SILENT, 0, "rank 2 on host here has not answered for 0.3 s");
}

static void a_member_that_makes_no_sense_is_named(void **state)
{
    (void)state;
    ends_well(BABBLES, 0, "rank 2 on host here said something that makes no sense");
}

static void a_member_that_fails_says_why(void **state)
{
    (void)state;
    ends_well(FAILS, 0, "rank 2 on host here: no more paper");
}

static void an_interruption_leaves_the_slice_undone(void **state)
{
    (void)state;
    for (int after = 2; after < 60; after += 11)
        ends_well(WORKS, after, NULL);
}

static void other_settings_are_refused_by_name(void **state)
{
    (void)state;
    struct stage stage;
    struct base_err err = {0};
    assemble(&stage, 3, 1, OTHER_SETTINGS, 60.0);
    assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "rank 2 on host here has b=3, but rank 0 has b=2"));
    part(&stage, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_processes_gives_the_bytes_of_one),
        cmocka_unit_test(a_silent_member_is_named_and_nothing_is_lost),
        cmocka_unit_test(a_member_that_makes_no_sense_is_named),
        cmocka_unit_test(a_member_that_fails_says_why),
        cmocka_unit_test(an_interruption_leaves_the_slice_undone),
        cmocka_unit_test(other_settings_are_refused_by_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
