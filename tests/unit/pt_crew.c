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
#include <unistd.h>
#include <stdatomic.h>

#include "base/clock.h"
#include "render/checkpoint.h"
#include "render/crew_member.h"
#include "render/crew_messages.h"
#include "support/pt_fake.h"
#include "support/pt_heard.h"
#include "support/base_room.h"

/* DEAF: it samples, but does not answer when the criterion is to be asked. LIES: what it says of its rows is wrong. */
enum behaviour { WORKS, SILENT, BABBLES, FAILS, DEAF, LIES, OTHER_SETTINGS, ABSENT };
enum { LIE_ROW, LIE_LEFT, LIE_RIGHT, LIE_PLACE, LIE_PLANES, LIE_COUNT, LIE_SIZE, LIE_KINDS };
static int lie;

/* The fake criterion without history, which others may ask too; how many blocks they did ask about. */
static struct lull_criterion pure;
static _Thread_local int is_member;
static atomic_int asked_elsewhere;

static int32_t pure_evaluate(struct lull_instance *i, const struct lull_view *view, const struct lull_block *blocks,
                             uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                             uint32_t count, struct lull_error *err)
{
    int32_t code = pt_fake_criterion()->evaluate(i, view, blocks, block_stride, decisions, decision_stride, count, err);
    for (uint32_t k = 0; k < count; k++)
        decisions[k].p_noisy = 0.25;
    double start_s = base_clock_thread_s();
    while (base_clock_thread_s() - start_s < 0.0005 * count) /* dear enough to be sent */
        continue;
    if (is_member)
        atomic_fetch_add(&asked_elsewhere, (int)count);
    return code;
}

static const void *no_extension(const char *id)
{
    (void)id;
    return NULL;
}

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

static void sample(struct member *m, struct pt_crew_rows *rows, size_t size)
{
    unsigned char *sums = (unsigned char *)(rows->rows + rows->count);
    const struct pt_row_maker maker = {NULL, pt_fake_noise, &rows->integrator};
    struct base_err err = {0};
    for (uint32_t i = 0; i < rows->count; i++) {
        struct pt_row *row = &rows->rows[i];
        struct pt_film film;
        pt_film_init(&film, row->x0, row->y, row->x1, row->y + 1, rows->planes, &err);
        pt_row_restore(&film, row, sums);
        pt_row_sample(&maker, &film, row);
        pt_row_save(&film, row, sums);
        sums += pt_row_bytes(row, rows->planes);
        pt_film_release(&film);
    }
    if (m->behaviour == LIES) {
        rows->rows[0].y += lie == LIE_ROW;
        rows->rows[0].x0 += lie == LIE_LEFT;
        rows->rows[0].x1 -= lie == LIE_RIGHT;
        rows->rows[0].place += lie == LIE_PLACE ? 1000000 : 0;
        rows->planes ^= lie == LIE_PLANES ? PT_FILM_DEPTH : 0;
        rows->count += lie == LIE_COUNT ? 1000000 : 0;
        size -= lie == LIE_SIZE;
    }
    base_peers_send(m->peers, 0, rows, size, &err);
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
            if ((m->behaviour == SILENT || m->behaviour == DEAF) && answered)
                return; /* rank 0 gives it up: nobody will say anything any more */
            continue;
        }
        const struct pt_crew_rows *rows = data;
        if ((m->behaviour == DEAF || m->behaviour == LIES) && rows->kind == PT_CREW_ROWS) {
            sample(m, data, size);
            continue;
        }
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
    is_member = 1;
    if (m->behaviour == ABSENT)
        return NULL;
    struct pt_render_config config = pt_fake_config();
    struct lull_host_criterion *criterion = NULL;
    struct lull_pair pair = {"at", "32"};
    struct base_threads *threads = base_threads_create(m->threads, &err);
    struct pt_crew_tools tools = {threads, {NULL, pt_fake_noise, NULL}, NULL};
    config.planes = PT_FILM_ALL;
    pt_criterion_create(&pure, &pair, 1, threads, NULL, &criterion, &err);
    pt_render_create(&config, NULL, pt_fake_noise, threads, criterion, &tools.render, &err);
    pt_crew_member_join(m->peers, &tools, m->behaviour == OTHER_SETTINGS ? "a=1\nb=3\n" : "a=1\nb=2\n", &err);
    if (m->behaviour == WORKS || m->behaviour == OTHER_SETTINGS)
        pt_crew_member_serve(m->peers, &tools, &err);
    else
        misbehave(m);
    pt_render_destroy(tools.render);
    lull_host_close(criterion);
    base_threads_destroy(threads);
    return NULL;
}

struct stage {
    struct base_room *room;
    struct member members[BASE_ROOM_MAX];
    int count;
    struct pt_crew *crew;
};

static void assemble(struct stage *stage, int count, int threads, enum behaviour last, double timeout_s)
{
    struct base_err err = {0};
    *stage = (struct stage){.room = base_room_create(count), .count = count};
    assert_non_null(stage->room);
    for (int i = 1; i < count; i++) {
        stage->members[i] = (struct member){
            .peers = base_room_of(stage->room, i), .threads = threads, .behaviour = i == count - 1 ? last : WORKS};
        assert_int_equal(pthread_create(&stage->members[i].thread, NULL, member_main, &stage->members[i]), 0);
    }
    assert_int_equal(pt_crew_create(base_room_of(stage->room, 0), timeout_s, &stage->crew, &err), 0);
}

/* lost: the crew cannot be sent home, so that the test does it. */
static void part(struct stage *stage, int lost)
{
    pt_crew_dismiss(stage->crew, 2);
    assert_int_equal(base_room_aborted(stage->room), lost);
    for (int i = 1; i < stage->count; i++) {
        struct base_err err = {0};
        uint32_t *end = malloc(sizeof *end);
        *end = PT_CREW_END;
        base_peers_send(base_room_of(stage->room, 0), i, end, sizeof *end, &err); /* nobody reads it who was dismissed */
        pthread_join(stage->members[i].thread, NULL);
    }
    base_room_destroy(stage->room);
}

/* --- same bytes --------------------------------------------------------------------------------------------------------- */

static void assert_same(const struct pt_render *a, const struct pt_render *b)
{
    struct pt_film_array x[PT_FILM_ARRAYS], y[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&a->film, x);
    assert_int_equal(n, pt_film_list_arrays(&b->film, y));
    for (int i = 0; i < n; i++)
        assert_memory_equal(x[i].data, y[i].data, x[i].bytes);
    for (uint32_t i = 0; i < a->blocks->count; i++) {
        const struct lull_host_block *p = &a->blocks->list[i], *q = &b->blocks->list[i];
        assert_true(p->spp == q->spp && p->reason == q->reason && p->checks == q->checks && p->rays == q->rays);
        assert_true(p->dropped == q->dropped);
        assert_memory_equal(&p->error, &q->error, sizeof p->error);
    }
    assert_true(a->totals->samples == b->totals->samples && a->totals->rays == b->totals->rays);
}

struct run {
    struct pt_render *render;
    struct lull_host_criterion *criterion;
    struct base_threads *pool;
};

static void release(struct run *r)
{
    pt_render_destroy(r->render);
    lull_host_close(r->criterion);
    base_threads_destroy(r->pool);
}

static void create(struct run *r, const struct pt_render_config *config, const struct lull_criterion *table, int threads)
{
    struct base_err err = {0};
    struct lull_pair pair = {"at", "32"};
    r->pool = base_threads_create(threads, &err);
    assert_int_equal(pt_criterion_create(table, &pair, 1, r->pool, NULL, &r->criterion, &err), 0);
    assert_int_equal(pt_render_create(config, NULL, pt_fake_noise, r->pool, r->criterion, &r->render, &err), 0);
}

static void finish(const struct run *r)
{
    const struct pt_render_hooks none = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    assert_int_equal(pt_render_run(r->render, &none, &outcome, &err), 0);
    assert_int_equal(outcome, PT_RENDER_DONE);
}

static void same_bytes(const struct lull_criterion *table)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    config.planes = PT_FILM_ALL;
    struct run one = {0};
    create(&one, &config, table, 1);
    finish(&one);
    const int sizes[][3] = {{2, 1, 1}, {3, 2, 1}, {8, 1, 2}, {5, 3, 3}}; /* processes, their threads, those of rank 0 */
    for (int i = 0; i < 4; i++) {
        struct stage stage;
        struct run many = {0};
        assemble(&stage, sizes[i][0], sizes[i][1], WORKS, 60.0);
        assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
        assert_int_equal(pt_crew_threads(stage.crew), (sizes[i][0] - 1) * sizes[i][1]);
        config.crew = stage.crew;
        config.order_seed = i == 3 ? 99 : 0;
        create(&many, &config, table, sizes[i][2]);
        finish(&many);
        assert_same(one.render, many.render);
        const struct pt_crew_traffic *traffic = pt_crew_traffic(stage.crew); /* every parcel comes back, and is as large */
        assert_true(traffic->messages >= 2 && traffic->messages < 1000000 && traffic->messages % 2 == 0);
        assert_true(traffic->bytes >= traffic->messages * sizeof(struct pt_crew_rows) && traffic->bytes < 1000000000 &&
                    traffic->bytes % 2 == 0);
        assert_true(traffic->waiting_s >= 0 && traffic->waiting_s < 1000);
        part(&stage, 0);
        release(&many);
    }
    release(&one);
}

static void any_number_of_processes_gives_the_bytes_of_one(void **state)
{
    (void)state;
    atomic_store(&asked_elsewhere, 0);
    same_bytes(pt_fake_criterion());
    assert_int_equal(atomic_load(&asked_elsewhere), 0); /* it has a history, which rank 0 keeps */
}

static void a_criterion_without_history_is_asked_by_all(void **state)
{
    (void)state;
    atomic_store(&asked_elsewhere, 0);
    same_bytes(&pure);
    assert_true(atomic_load(&asked_elsewhere) > 20);
}

/* Without a criterion blocks are cut by the crop: the first rows are narrower than others. */
static void rows_of_different_widths(void **state)
{
    (void)state;
    const struct pt_render_hooks none = {0};
    static const int crop[4] = {10, 9, 37, 20};
    struct pt_render_config config = pt_fake_config();
    struct pt_render *renders[2];
    struct stage stage;
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    struct base_threads *pool = base_threads_create(2, &err);
    memcpy(config.crop, crop, sizeof crop);
    config.uniform = 1;
    config.spp_min = config.spp_max = 40;
    config.planes = PT_FILM_ALL;
    assemble(&stage, 3, 1, WORKS, 60.0);
    assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
    for (int i = 0; i < 2; i++) {
        config.crew = i ? stage.crew : NULL;
        assert_int_equal(pt_render_create(&config, NULL, pt_fake_noise, pool, NULL, &renders[i], &err), 0);
        assert_int_equal(pt_render_run(renders[i], &none, &outcome, &err), 0);
    }
    part(&stage, 0);
    assert_same(renders[0], renders[1]);
    pt_render_destroy(renders[0]);
    pt_render_destroy(renders[1]);
    base_threads_destroy(pool);
}

/* --- faults ------------------------------------------------------------------------------------------------------------- */

struct watch {
    const char *checkpoint;
    int left; /* interrupted() says yes from the time that 1 is left; 0: never */
};

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
static void ends_well(const struct lull_criterion *table, enum behaviour last, int interrupt_after, const char *words)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    struct watch watch = {.checkpoint = "/tmp/pt_crew_test.ckp", .left = interrupt_after};
    struct heard heard;
    hear_begin(&heard);
    const struct pt_render_hooks hooks = {.interrupted = count_down, .suspend = save, .log = &heard.log, .data = &watch};
    struct run one = {0}, lost = {0}, rest = {0};
    struct stage stage;
    config.planes = PT_FILM_ALL;
    create(&one, &config, table, 1);
    finish(&one);
    create(&rest, &config, table, 2);
    assemble(&stage, 3, 1, last, last == SILENT || last == DEAF ? 2.0 : 60.0); /* machines may be busy */
    assert_int_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
    config.crew = stage.crew;
    create(&lost, &config, table, 2);
    assert_int_equal(pt_render_run(lost.render, &hooks, &outcome, &err), 0);
    assert_int_equal(outcome, words ? PT_RENDER_LOST : PT_RENDER_INTERRUPTED);
    part(&stage, last == SILENT || last == DEAF);
    assert_int_equal(pt_checkpoint_load(watch.checkpoint, rest.render, "settings\n", &err), 0);
    finish(&rest);
    if (words)
        assert_non_null(strstr(heard.text, words));
    assert_same(one.render, rest.render);
    release(&one);
    release(&lost);
    release(&rest);
    remove(watch.checkpoint);
    hear_end(&heard);
}

static void a_silent_member_is_named_and_nothing_is_lost(void **state)
{
    (void)state;
    ends_well(pt_fake_criterion(), SILENT, 0, "rank 2 on host here has not answered for 2 s");
}

static void a_member_that_is_silent_when_asked_is_named(void **state)
{
    (void)state;
    ends_well(&pure, DEAF, 0, "rank 2 on host here has not answered for 2 s");
}

static void a_member_that_makes_no_sense_is_named(void **state)
{
    (void)state;
    ends_well(pt_fake_criterion(), BABBLES, 0, "rank 2 on host here said something that makes no sense");
}

static void a_member_whose_rows_are_not_those_sent_is_named(void **state)
{
    (void)state;
    for (lie = 0; lie < LIE_KINDS; lie++)
        ends_well(pt_fake_criterion(), LIES, 0, "rank 2 on host here said something that makes no sense");
}

static void a_member_that_fails_says_why(void **state)
{
    (void)state;
    ends_well(pt_fake_criterion(), FAILS, 0, "rank 2 on host here: no more paper");
}

static void an_interruption_leaves_the_slice_undone(void **state)
{
    (void)state;
    for (int after = 2; after < 60; after += 11)
        ends_well(after % 2 ? &pure : pt_fake_criterion(), WORKS, after, NULL);
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

static void who_never_says_hello_is_named(void **state)
{
    (void)state;
    struct stage stage;
    struct base_err err = {0};
    alarm(60); /* waiting for ever is a failure */
    assemble(&stage, 3, 1, ABSENT, 2.0);
    assert_int_not_equal(pt_crew_greet(stage.crew, "a=1\nb=2\n", &err), 0);
    assert_non_null(strstr(err.text, "rank 2 on host here has not answered for 2 s"));
    part(&stage, 1);
    alarm(0);
}

int main(void)
{
    pure = *pt_fake_criterion();
    pure.evaluate = pure_evaluate;
    pure.get_extension = no_extension;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_processes_gives_the_bytes_of_one),
        cmocka_unit_test(a_criterion_without_history_is_asked_by_all),
        cmocka_unit_test(rows_of_different_widths),
        cmocka_unit_test(a_member_that_is_silent_when_asked_is_named),
        cmocka_unit_test(a_silent_member_is_named_and_nothing_is_lost),
        cmocka_unit_test(a_member_that_makes_no_sense_is_named),
        cmocka_unit_test(a_member_whose_rows_are_not_those_sent_is_named),
        cmocka_unit_test(a_member_that_fails_says_why),
        cmocka_unit_test(an_interruption_leaves_the_slice_undone),
        cmocka_unit_test(other_settings_are_refused_by_name),
        cmocka_unit_test(who_never_says_hello_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
