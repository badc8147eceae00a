/* How far a render is, and how long it will take: the line, what it says, when it comes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "base/clock.h"
#include "render/progress.h"
#include "support/pt_fake.h"

static struct pt_fake_run run;

static int setup(void **state)
{
    (void)state;
    struct pt_render_config config = pt_fake_config();
    run = pt_fake_render(&config, pt_fake_noise, 2, "32");
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    pt_fake_release(&run);
    return 0;
}

/* Redrawn in place on a terminal, a line now and then elsewhere, nothing without a file. */
static void progress_lines(void **state)
{
    (void)state;
    struct pt_progress p;
    struct base_log log;
    double percent = 0;
    char line[300], expected[300], *text = NULL;
    size_t n;
    FILE *out = open_memstream(&text, &n), *null = fopen("/dev/null", "w");
    assert_true(out && null);
    double before_s = base_clock_wall_s();
    base_log_init(&log, null, "name", 0);
    pt_progress_init(&p, &log);
    assert_true(!log.terminal && p.next_s >= before_s + 2 && p.next_s <= base_clock_wall_s() + 2 && !log.live);
    pt_progress_text(&(struct pt_progress_pace){0}, run.render, &percent, line, sizeof line);
    assert_string_equal(line + strlen(line) - 8, "ETA 0:00");
    for (int terminal = 0; terminal < 2; terminal++) {
        rewind(out);
        before_s = base_clock_wall_s();
        log = (struct base_log){.out = out, .name = "name", .terminal = terminal};
        p = (struct pt_progress){.log = &log, .next_s = before_s + 1e6};
        pt_progress_update(&p, run.render); /* too early */
        p.next_s = 0;
        pt_progress_update(&p, run.render);
        const double pause_s = terminal ? 0.2 : 10;
        assert_true(log.live == terminal && p.next_s >= before_s + pause_s && p.next_s <= base_clock_wall_s() + pause_s);
        base_log_clear(&log);
        base_log_clear(&log); /* once is enough */
        snprintf(expected, sizeof expected, terminal ? "\r%s\033[K\r\033[K" : "%s\n", line);
        fputc('|', out);
        fflush(out);
        assert_memory_equal(text, expected, strlen(expected));
        assert_int_equal(text[strlen(expected)], '|');
        assert_false(log.live);
    }
    log = (struct base_log){.out = out, .quiet = 1};
    p = (struct pt_progress){.log = &log};
    long at = ftell(out);
    pt_progress_update(&p, run.render);
    base_log_clear(&log);
    assert_int_equal(ftell(out), at);
    fclose(out);
    fclose(null);
    free(text);
}

static void progress_is_honest(void **state)
{
    (void)state;
    double percent = 0;
    char text[256];
    struct pt_render r = *run.render;
    struct lull_host_block list[2] = {{.x1 = 10,
                                       .y1 = 10,
                                       .spp = 100,
                                       .next_spp = 120,
                                       .asked = 1,
                                       .asked_spp = 100,
                                       .predicted_spp = 200,
                                       .thread_s = 30.0},
                                      {.x1 = 10, .y1 = 10, .spp = 50, .reason = LULL_REASON_CRITERION, .thread_s = 10.0}};
    struct lull_host_blocks blocks = {.list = list, .count = 2, .spp_max = 1000};
    struct lull_host_totals totals = *run.render->totals;
    r.blocks = &blocks;
    r.totals = &totals;
    r.samples_per_s = 1000.0;
    r.busy_threads = 1.5; /* of 2 */
    r.sampled_rows = 20;
    r.totals->checks = 0;
    struct pt_progress_pace pace = {.busy = 1.5, .done_s = 40.0, .at_s = totals.render_s};
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, " 57%  1 of 2 blocks active  spp 100..100  0.00 Mpaths/s  ETA 0:20");
    list[0].predicted_spp = 400; /* a prediction grows */
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, " 57%  1 of 2 blocks active  spp 100..100  0.00 Mpaths/s  ETA 1:00");
    list[0].predicted_spp = (double)NAN;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, " 57%  1 of 2 blocks active  spp 100..100  0.00 Mpaths/s  ETA at most 3:00");
    percent = 0;
    blocks.spp_max = 40100; /* 40 thread seconds of 12,040 */
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, "  ?%  1 of 2 blocks active  spp 100..100  0.00 Mpaths/s  ETA at most 2:13:20");
    blocks.spp_max = 1000;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, ">= 12%  1 of 2 blocks active  spp 100..100  0.00 Mpaths/s  ETA at most 3:00");
    percent = 0;
    r.samples_per_s = 12.5e6;
    list[0].spp = 97; /* 310 thread seconds of 310 + 903 · 300 / 97 */
    list[0].thread_s = 300.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, ">=  9%  1 of 2 blocks active  spp 97..97  12.50 Mpaths/s  ETA at most 31:02");
    list[0].thread_s = 3000.0; /* 903 · 3000 / 97 thread seconds of 1.5 threads */
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, ">=  9%  1 of 2 blocks active  spp 97..97  12.50 Mpaths/s  ETA at most 5:10:19");
    r.totals->checks = 4; /* 2 s each: one at 120, 11.6 more in steps of 1.2 */
    r.totals->criterion_s = 8.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, ">=  9%  1 of 2 blocks active  spp 97..97  12.50 Mpaths/s  ETA at most 5:10:44");
    blocks.flags = LULL_HOST_UNIFORM; /* nobody is asked */
    list[0].next_spp = 1000;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, "  9%  1 of 2 blocks active  spp 97..97  12.50 Mpaths/s  ETA 5:10:19");
    blocks.flags = 0;
    list[0].next_spp = 120;
    list[1].reason = LULL_REASON_NONE;
    list[0].predicted_spp = list[1].predicted_spp = 150.0;
    list[1].asked = 1;
    list[1].asked_spp = list[1].next_spp = 50;
    list[0].thread_s = 97.0;
    list[1].thread_s = 50.0;
    r.totals->checks = 0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text); /* 53 s and 100 s of thread time on 1.5 threads */
    assert_string_equal(text, " 49%  2 of 2 blocks active  spp 50..97  12.50 Mpaths/s  ETA 1:42");
    r.config.time_budget_s = totals.render_s + totals.criterion_s + 4.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_non_null(strstr(text, "0:04"));
    r.totals->render_s = 92.0; /* 100 s with the criterion's */
    r.config.time_budget_s = 125.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, " 80%  2 of 2 blocks active  spp 50..97  12.50 Mpaths/s  ETA 0:25");
    r.config.time_budget_s = 80.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_string_equal(text, "100%  2 of 2 blocks active  spp 50..97  12.50 Mpaths/s  ETA 0:00");
    r.config.time_budget_s = 0.0;
    r.busy_threads = 0.0;
    pt_progress_text(&pace, &r, &percent, text, sizeof text);
    assert_non_null(strstr(text, "ETA unknown"));
}

/* --- the time left while other programs come and go --- */

struct eta {
    double at_s, told_s, recent_s; /* time of it; what is said; what the pace of the last second or so would say */
};

/* A render of two threads on processors whose free part changes at random every two seconds, and from slice to slice, in simulated
 * time. list: [room], a line a second. Returns how many; *end_s: when it is over. */
static int simulate_eta(uint32_t seed, struct eta *list, int room, double *end_s)
{
    enum { SLICES = 4 }; /* a second */
    struct pt_render r = *run.render;
    struct lull_host_block b = {.x1 = 200, .y1 = 200, .next_spp = 1000, .asked = 1, .asked_spp = 1, .predicted_spp = 1000};
    struct lull_host_blocks blocks = {.list = &b, .count = 1, .spp_max = 10000};
    struct lull_host_totals totals = {0};
    struct pt_progress_pace pace = {0};
    double level = 1.0, recent = 0.0;
    int n = 0;
    r.blocks = &blocks;
    r.totals = &totals;
    r.sampled_rows = 200;
    for (int k = 1; b.thread_s < 100.0 && n < room; k++) { /* a tenth of a thread second a sample */
        seed = seed * 1664525u + 1013904223u;
        if (seed >> 24 < 256 / 8) /* every two seconds */
            level = 0.25 + (double)(seed >> 8 & 255) / 256.0 * 1.5;
        const double busy = level * (0.5 + (double)(seed >> 16 & 255) / 256.0);
        recent = recent > 0.0 ? 0.7 * recent + 0.3 * busy : busy;
        r.busy_threads = recent;
        totals.render_s = (double)k / SLICES;
        b.thread_s += busy / SLICES;
        b.spp = (uint64_t)(10.0 * b.thread_s);
        if (k % SLICES == 0 && b.spp < 1000)
            list[n++] = (struct eta){totals.render_s, pt_progress_of(&pace, &r).left_s, (100.0 - b.thread_s) / recent};
    }
    *end_s = totals.render_s;
    return n;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Five renders: the median error at a quarter, half and three quarters of the time, and by how much the time left rises in all,
 * beside what the pace of the last second says. */
static void time_left_falls(void **state)
{
    (void)state;
    enum { RENDERS = 5, ROOM = 4000 };
    static struct eta list[ROOM];
    double error[3][RENDERS], recent_error[3][RENDERS], rises = 0.0, recent_rises = 0.0, all_s = 0.0;
    for (uint32_t seed = 0; seed < RENDERS; seed++) {
        double end_s;
        const int n = simulate_eta(seed + 1, list, ROOM, &end_s);
        all_s += end_s;
        for (int i = 1; i < n; i++) {
            rises += fmax(0.0, list[i].told_s - list[i - 1].told_s);
            recent_rises += fmax(0.0, list[i].recent_s - list[i - 1].recent_s);
        }
        for (int q = 0; q < 3; q++) {
            const struct eta *e = &list[n * (q + 1) / 4];
            error[q][seed] = fabs(e->told_s / (end_s - e->at_s) - 1.0);
            recent_error[q][seed] = fabs(e->recent_s / (end_s - e->at_s) - 1.0);
        }
    }
    for (int q = 0; q < 3; q++) {
        qsort(error[q], RENDERS, sizeof error[q][0], by_size);
        qsort(recent_error[q], RENDERS, sizeof recent_error[q][0], by_size);
        print_message("time left after %d/4: median error %.0f %%; by the last second's pace %.0f %%\n", q + 1,
                      100.0 * error[q][RENDERS / 2], 100.0 * recent_error[q][RENDERS / 2]);
    }
    print_message("it rises by %.2f of the time in all; by the last second's pace by %.2f\n", rises / all_s,
                  recent_rises / all_s);
    assert_true(error[0][RENDERS / 2] < 0.25 && error[1][RENDERS / 2] < 0.25 && error[2][RENDERS / 2] < 0.25);
    assert_true(rises < 0.25 * recent_rises);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(progress_is_honest), cmocka_unit_test(time_left_falls),
                                       cmocka_unit_test(progress_lines)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
