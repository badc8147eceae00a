/* A render's farm with threads for processes: the film of one process, and every way in which a worker can fail. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>

#include "base/clock.h"
#include "render/checkpoint.h"
#include "job/message.h"
#include "render/farm.h"
#include "render/render.h"
#include "support/pt_fake.h"
#include "support/pt_captured.h"
#include "support/base_transport.h"
#include "support/pt_identity.h"

/* LIES: what it says of its rows is wrong. */
enum behaviour { WORKS, SILENT, BABBLES, FAILS, LIES, OTHER_SETTINGS, ABSENT };
enum { LIE_ROW, LIE_LEFT, LIE_RIGHT, LIE_FIRST, LIE_SERIAL, LIE_COUNT, LIE_SIZE, LIE_KINDS };
static int lie;

/* A signal comes to the main thread, which serves the workers, after so many calls of the kernel; 0: never. Calls of every
 * thread count, because how the work is shared depends on the clock. */
static volatile sig_atomic_t interrupted;
static atomic_int calls_left;
static pthread_t main_thread;

static void interrupt(int sign)
{
    (void)sign;
    interrupted = 1;
}

static void count_call(void)
{
    if (atomic_load(&calls_left) > 0 && atomic_fetch_sub(&calls_left, 1) == 1)
        pthread_kill(main_thread, SIGUSR1);
}

static void counted_noise(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y,
                          int count, uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x, y, count, sample, out);
    count_call();
}

/* A time-out for busy machines, and one that is over at once. */
static const double LONG_S = 60, OVER_S = 1e-9;
/* The last worker says nothing any more, ever: rank 0 may stop waiting. */
static atomic_int fell_silent;

struct worker {
    pthread_t thread;
    struct job_transport *transport;
    enum behaviour behaviour;
    int threads;
};

static void send_words(struct job_transport *to, uint32_t kind, const char *words)
{
    struct base_err err = {0};
    struct job_farewell *f = calloc(1, sizeof *f);
    *f = (struct job_farewell){.head.kind = kind, .status = words[0] != '\0' ? 2 : 0};
    strncpy(f->text, words, sizeof f->text - 1);
    to->calls->send(to, 0, f, sizeof *f, &err);
}

/* Items of rows are answered in their own form: the row, then its sums. */
static void sample(struct worker *w, struct job_task *task, size_t size)
{
    const uint32_t planes = *(const uint32_t *)job_task_common(task);
    const struct pt_integrator *integrator = (const struct pt_integrator *)((const uint32_t *)job_task_common(task) + 1);
    const struct pt_sampler_context context = {NULL, pt_fake_noise, integrator};
    struct base_err err = {0};
    for (uint32_t i = 0; i < task->count; i++) {
        struct pt_row *row = job_task_item(task, i);
        unsigned char *sums = (unsigned char *)(row + 1);
        struct pt_film film;
        pt_film_init(&film, row->x0, row->y, row->x1, row->y + 1, planes, &err);
        pt_row_restore(&film, row, sums);
        pt_row_sample(&context, &film, row);
        pt_row_save(&film, row, sums);
        pt_film_release(&film);
    }
    struct pt_row *first = job_task_item(task, 0);
    if (w->behaviour == LIES) {
        first->y += lie == LIE_ROW;
        first->x0 += lie == LIE_LEFT;
        first->x1 -= lie == LIE_RIGHT;
        task->first += lie == LIE_FIRST ? 1000000 : 0;
        task->serial += lie == LIE_SERIAL;
        task->count += lie == LIE_COUNT ? 1000000 : 0;
        size -= lie == LIE_SIZE;
    }
    task->kind = JOB_ANSWER;
    memmove(task->bytes, task->bytes + task->common_bytes, size - sizeof *task - task->common_bytes);
    w->transport->calls->send(w->transport, 0, task, size - task->common_bytes, &err);
}

/* Takes what comes until rank 0 says that it is over; answers the first task as it is told to. */
static void misbehave(struct worker *w)
{
    struct job_transport *t = w->transport;
    for (int over = 0, answered = 0; !over;) {
        int rank;
        void *data;
        size_t size;
        struct base_err err = {0};
        if (t->calls->receive(t, 0.05, &rank, &data, &size, &err) <= 0) {
            if (w->behaviour == SILENT && answered) {
                atomic_store(&fell_silent, 1);
                return;
            }
            continue;
        }
        struct job_task *task = data;
        if (w->behaviour == LIES && task->kind == JOB_TASK) {
            sample(w, task, size);
            continue;
        }
        over = task->kind == JOB_END;
        if (!over && w->behaviour == BABBLES && !answered)
            send_words(t, JOB_ANSWER, "what is this");
        if (!over && w->behaviour == FAILS && !answered)
            send_words(t, JOB_FAREWELL, "no more paper");
        answered = 1;
        free(data);
    }
    send_words(t, JOB_FAREWELL, "");
}

static void *worker_main(void *arg)
{
    struct worker *w = arg;
    struct base_err err = {0};
    struct job *job;
    if (w->behaviour == ABSENT) {
        atomic_store(&fell_silent, 1);
        return NULL;
    }
    struct base_threads *threads = base_threads_create(w->threads, &err);
    const struct pt_sampler_context context = {NULL, counted_noise, NULL};
    job_create(w->transport, &job, &err);
    job_handshake(job, w->behaviour == OTHER_SETTINGS ? "a=1\nb=3\n" : "a=1\nb=2\n", w->threads, &err);
    if (w->behaviour == WORKS || w->behaviour == OTHER_SETTINGS) {
        pt_farm_serve(job, threads, &context, &err);
        job_close(job, 0, "", &err);
    } else {
        misbehave(w);
        free(job->workers);
        free(job);
    }
    base_threads_destroy(threads);
    return NULL;
}

struct stage {
    struct base_transport *transport;
    struct worker workers[BASE_TRANSPORT_MAX];
    int count;
    struct job *job;
};

/* Nothing has come for rank 0. If nobody else owes it a greeting or an answer, it need not wait for who fell silent. */
static void end_the_wait(void *data)
{
    const struct stage *stage = data;
    int owed = 0;
    for (int i = 1; i < stage->count - 1; i++)
        owed |= stage->job->workers[i].threads == 0 || stage->job->workers[i].held_count > 0;
    if (atomic_load(&fell_silent) && !owed)
        job_watch(stage->job, OVER_S, &interrupted);
}

static void assemble(struct stage *stage, int count, int threads, enum behaviour last)
{
    struct base_err err = {0};
    *stage = (struct stage){.transport = base_transport_create(count), .count = count};
    assert_non_null(stage->transport);
    atomic_store(&fell_silent, 0);
    for (int i = 1; i < count; i++) {
        stage->workers[i] = (struct worker){.transport = base_transport_of(stage->transport, i),
                                            .threads = threads,
                                            .behaviour = i == count - 1 ? last : WORKS};
        assert_int_equal(pthread_create(&stage->workers[i].thread, NULL, worker_main, &stage->workers[i]), 0);
    }
    assert_int_equal(job_create(base_transport_of(stage->transport, 0), &stage->job, &err), 0);
    job_watch(stage->job, LONG_S, &interrupted);
    base_transport_listen(stage->transport, end_the_wait, stage);
}

/* lost: the workers cannot be told the end, so that the test does it. */
static void part(struct stage *stage, int lost)
{
    struct base_err err = {0};
    job_close(stage->job, 2, "", &err);
    assert_int_equal(base_transport_aborted(stage->transport), lost);
    for (int i = 1; i < stage->count; i++) {
        struct job_transport *t = base_transport_of(stage->transport, 0);
        struct job_message *end = malloc(sizeof *end);
        *end = (struct job_message){JOB_END, 2};
        t->calls->send(t, i, end, sizeof *end, &err); /* nobody reads it who has ended */
        pthread_join(stage->workers[i].thread, NULL);
    }
    base_transport_destroy(stage->transport);
}

/* --- same bytes --------------------------------------------------------------------------------------------------------- */

static void assert_same(const struct pt_render *a, const struct pt_render *b)
{
    struct pt_film_array x[PT_FILM_ARRAYS], y[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&a->film, 0, a->film.pixels, x);
    assert_int_equal(n, pt_film_list_arrays(&b->film, 0, b->film.pixels, y));
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

static void create(struct run *r, const struct pt_render_config *config, int threads)
{
    struct base_err err = {0};
    struct lull_pair pair = {"at", "32"};
    r->pool = base_threads_create(threads, &err);
    assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r->pool, NULL, &r->criterion, &err), 0);
    assert_int_equal(pt_render_create(config, NULL, counted_noise, r->pool, r->criterion, &r->render, &err), 0);
}

static void finish(const struct run *r)
{
    const struct pt_render_hooks none = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    assert_int_equal(pt_render_run(r->render, &none, &outcome, &err), 0);
    assert_int_equal(outcome, PT_RENDER_DONE);
}

static void any_number_of_processes_gives_the_bytes_of_one(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    config.planes = PT_FILM_ALL;
    struct run one = {0};
    create(&one, &config, 1);
    finish(&one);
    const int sizes[][3] = {{2, 1, 1}, {3, 2, 1}, {8, 1, 2}, {5, 3, 3}}; /* processes, their threads, those of rank 0 */
    for (int i = 0; i < 4; i++) {
        struct stage stage;
        struct run many = {0};
        assemble(&stage, sizes[i][0], sizes[i][1], WORKS);
        assert_int_equal(job_handshake(stage.job, "a=1\nb=2\n", 1, &err), 0);
        assert_int_equal(job_worker_threads(stage.job), (sizes[i][0] - 1) * sizes[i][1]);
        config.job = stage.job;
        config.order_seed = i == 3 ? 99 : 0;
        create(&many, &config, sizes[i][2]);
        finish(&many);
        assert_same(one.render, many.render);
        const struct job_traffic traffic = job_traffic(stage.job); /* every task is answered; hello from each */
        const uint64_t tasks = traffic.messages - (uint64_t)(sizes[i][0] - 1);
        assert_true(tasks >= 2 && tasks < 1000000 && tasks % 2 == 0);
        assert_true(traffic.bytes >= tasks * sizeof(struct job_task) && traffic.bytes < 1000000000);
        assert_true(traffic.waiting_s >= 0 && traffic.waiting_s < 1000);
        part(&stage, 0);
        release(&many);
    }
    release(&one);
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
    assemble(&stage, 3, 1, WORKS);
    assert_int_equal(job_handshake(stage.job, "a=1\nb=2\n", 1, &err), 0);
    for (int i = 0; i < 2; i++) {
        config.job = i ? stage.job : NULL;
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
};

static int save(void *data, struct pt_render *r, struct base_err *err)
{
    const struct watch *w = data;
    return pt_checkpoint_save(w->checkpoint, r, PT_IDENTITY("settings\n"), err);
}

/* Renders with workers until one is lost or it is interrupted after so many calls; the checkpoint then goes on alone to the
 * bytes of one process. */
static void ends_well(enum behaviour last, int interrupt_after, const char *words)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    enum pt_render_outcome outcome;
    struct watch watch = {.checkpoint = "/tmp/pt_farm_test.ckp"};
    struct captured messages;
    capture_begin(&messages);
    const struct pt_render_hooks hooks = {
        .interrupted = &interrupted, .suspend = save, .log = &messages.log, .data = &watch};
    struct run one = {0}, lost = {0}, rest = {0};
    struct stage stage;
    config.planes = PT_FILM_ALL;
    create(&one, &config, 1);
    finish(&one);
    create(&rest, &config, 2);
    assemble(&stage, 3, 1, last);
    assert_int_equal(job_handshake(stage.job, "a=1\nb=2\n", 1, &err), 0);
    config.job = stage.job;
    interrupted = 0;
    atomic_store(&calls_left, interrupt_after);
    create(&lost, &config, 2);
    assert_int_equal(pt_render_run(lost.render, &hooks, &outcome, &err), 0);
    assert_int_equal(outcome, words ? PT_RENDER_LOST : PT_RENDER_INTERRUPTED);
    part(&stage, last == SILENT);
    assert_int_equal(pt_checkpoint_load(watch.checkpoint, rest.render, PT_IDENTITY("settings\n"), &err), 0);
    finish(&rest);
    if (words)
        assert_non_null(strstr(messages.text, words));
    assert_same(one.render, rest.render);
    release(&one);
    release(&lost);
    release(&rest);
    remove(watch.checkpoint);
    capture_end(&messages);
}

static void a_silent_worker_is_named_and_nothing_is_lost(void **state)
{
    (void)state;
    ends_well(SILENT, 0, "rank 2 on host here has not answered for 1e-09 s");
}

static void a_worker_that_makes_no_sense_is_named(void **state)
{
    (void)state;
    ends_well(BABBLES, 0, "rank 2 on host here said something that makes no sense");
}

static void a_worker_whose_rows_are_not_those_sent_is_named(void **state)
{
    (void)state;
    for (lie = 0; lie < LIE_KINDS; lie++)
        ends_well(LIES, 0, "rank 2 on host here said something that makes no sense");
}

static void a_worker_that_fails_says_why(void **state)
{
    (void)state;
    ends_well(FAILS, 0, "rank 2 on host here: no more paper");
}

static void an_interruption_leaves_the_slice_undone(void **state)
{
    (void)state;
    for (int after = 400; after < 4000; after += 600)
        ends_well(WORKS, after, NULL);
}

static void other_settings_are_refused_by_name(void **state)
{
    (void)state;
    struct stage stage;
    struct base_err err = {0};
    assemble(&stage, 3, 1, OTHER_SETTINGS);
    assert_int_equal(job_handshake(stage.job, "a=1\nb=2\n", 1, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "rank 2 on host here has b=3, but rank 0 has b=2"));
    part(&stage, 0);
}

static void who_never_says_hello_is_named(void **state)
{
    (void)state;
    struct stage stage;
    struct base_err err = {0};
    assemble(&stage, 3, 1, ABSENT);
    assert_int_not_equal(job_handshake(stage.job, "a=1\nb=2\n", 1, &err), 0);
    assert_non_null(strstr(err.text, "rank 2 on host here has not answered for 1e-09 s"));
    part(&stage, 1);
}

int main(void)
{
    main_thread = pthread_self();
    sigaction(SIGUSR1, &(struct sigaction){.sa_handler = interrupt}, NULL);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_processes_gives_the_bytes_of_one),
        cmocka_unit_test(rows_of_different_widths),
        cmocka_unit_test(a_silent_worker_is_named_and_nothing_is_lost),
        cmocka_unit_test(a_worker_that_makes_no_sense_is_named),
        cmocka_unit_test(a_worker_whose_rows_are_not_those_sent_is_named),
        cmocka_unit_test(a_worker_that_fails_says_why),
        cmocka_unit_test(an_interruption_leaves_the_slice_undone),
        cmocka_unit_test(other_settings_are_refused_by_name),
        cmocka_unit_test(who_never_says_hello_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
