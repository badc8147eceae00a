/*
 * Whole trainings of tiny networks on made-up blocks that are not square: everything they say and write (progress, learning curves, card,
 * checkpoint, weights) against tests/golden/ggn_train_runs.txt; interrupted after each epoch and resumed, the same
 * bytes; every refusal as a whole line. With the kernels of any processor, so that another one computes the same.
 */
#define _GNU_SOURCE /* syscall, fopencookie, memmem */
#include "support/ggn_cmocka.h"

#include <dirent.h>
#include <math.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "model/container.h"
#include "model/model.h"
#include "support/approve.h"
#include "support/ggn_heap.h"
#include "support/ggn_noise.h"
#include "train/phase.h"
#include "train/train.h"

enum { WIDTH = 24, HEIGHT = 20 };

static char dir[] = "/tmp/ggn_runs.XXXXXX", data[64], bare[64];
static FILE *report;
static char *reported;
static size_t reported_size;

/* Seconds pass as somebody looks: 41.375 for each look at either clock. */
int clock_gettime(clockid_t id, struct timespec *t)
{
    static atomic_long all_looks[2];

    if (id != CLOCK_MONOTONIC && id != CLOCK_PROCESS_CPUTIME_ID)
        return (int)syscall(SYS_clock_gettime, id, t);
    const long looks = atomic_fetch_add(&all_looks[id != CLOCK_MONOTONIC], 1);
    *t = (struct timespec){.tv_sec = looks * 331 / 8, .tv_nsec = looks * 331 % 8 * 125000000};
    return 0;
}

/* No child has taken any of them, whatever else ran in this process. */
int getrusage(__rusage_who_t who, struct rusage *usage)
{
    (void)who;
    *usage = (struct rusage){0};
    return 0;
}

/* --- data ------------------------------------------------------------------------------------------------------------------------------ */

static void make_views(const char *to, uint32_t reference_spp, double samples_per_variance)
{
    static const uint32_t levels[] = {4, 6, 9, 14, 20, 30, 45, 68};
    static const double sigma[3][2] = {{0.2, 0.5}, {0.3, 0.45}, {0.7, 0.35}};

    assert_int_equal(mkdir(to, 0777), 0);
    for (uint32_t v = 0; v < 3; v++) {
        struct ggn_noise n = {WIDTH, HEIGHT, levels, 8, reference_spp, 0, 0.05 * v, v + 1, v < 2 ? 1.5 + v : 0};
        char view[96], scene[16];
        snprintf(view, sizeof view, "%s/view%u", to, v);
        snprintf(scene, sizeof scene, "scene%u", v);
        ggn_noise_view(view, scene, &n, sigma[v], 2, samples_per_variance);
    }
}

static int setup(void **state)
{
    (void)state;
    setenv("LULL_ISA", "base", 1);
    if (!mkdtemp(dir))
        return -1;
    snprintf(data, sizeof data, "%s/data", dir);
    snprintf(bare, sizeof bare, "%s/bare", dir);
    make_views(data, 512, 120);
    make_views(bare, 0, 120);
    report = open_memstream(&reported, &reported_size);
    return report ? 0 : -1;
}

static int teardown(void **state)
{
    char command[64];
    (void)state;
    fclose(report);
    free(reported);
    snprintf(command, sizeof command, "/bin/rm -r %s", dir);
    return system(command);
}

static char *path_of(const char *name, const char *suffix)
{
    static char path[64][128];
    static int next;
    char *p = path[next++ % 64];

    snprintf(p, sizeof path[0], "%s/%s.ggn%s", dir, name, suffix);
    return p;
}

/* --- report ---------------------------------------------------------------------------------------------------------------------------- */

/* Text with the folder's name masked. */
static void put(const char *text)
{
    for (const char *hit; (hit = strstr(text, dir)) != NULL; text = hit + strlen(dir))
        fprintf(report, "%.*sDIR", (int)(hit - text), text);
    fputs(text, report);
}

static char *read_all(const char *path)
{
    char *text;
    size_t size;
    struct base_err err = {0};

    if (base_file_read(path, 1 << 24, &text, &size, &err))
        fail_msg("%s", err.text);
    return text;
}

static void put_file(const char *path)
{
    char *text = read_all(path);

    put(text);
    free(text);
}

static void put_numbers(const char *name, const float *x, size_t n)
{
    double square = 0, wave = 0;

    for (size_t i = 0; i < n; i++) {
        square += (double)x[i] * (double)x[i];
        wave += (double)x[i] * cos(0.7 * (double)i);
    }
    fprintf(report, "%s [%zu] rms %.7g wave %.5f\n", name, n, sqrt(square / (double)n), wave / (double)n);
}

static void put_checkpoint(const char *path)
{
    struct ggn_container c;
    struct base_err err = {0};

    if (ggn_container_read(&c, path, &err))
        fail_msg("%s", err.text);
    cJSON *root = cJSON_Parse(c.json);
    cJSON_DeleteItemFromObject(root, "identity"); /* hashes of the pixels, which libm has a part in */
    char *text = cJSON_PrintUnformatted(root);
    fprintf(report, "%s\n", text);
    free(text);
    cJSON_Delete(root);
    for (int i = 0; i < c.n_entries; i++) {
        int dim = (int)c.entry[i].count;
        float *x = malloc(c.entry[i].count * sizeof *x);
        assert_int_equal(ggn_container_get(&c, c.entry[i].name, 1, &dim, x, &err), 0);
        put_numbers(c.entry[i].name, x, c.entry[i].count);
        free(x);
    }
    ggn_container_release(&c);
}

static void put_card(const char *path)
{
    char *text = read_all(path);
    cJSON *root = cJSON_Parse(text);

    assert_non_null(root);
    cJSON_DeleteItemFromObject(cJSON_GetObjectItem(root, "training"), "data_key");
    free(text);
    text = cJSON_Print(root);
    fprintf(report, "%s\n", text);
    free(text);
    cJSON_Delete(root);
}

static void put_model(const char *path)
{
    struct ggn_model *m;
    struct base_err err = {0};

    if (ggn_model_load(path, &m, &err))
        fail_msg("%s", err.text);
    for (int net = 0; net < GGN_NETS; net++)
        put_numbers(m->graph[net].name, m->weights[net]->params, m->graph[net].n_learned);
    ggn_model_destroy(m);
}

/* --- runs ------------------------------------------------------------------------------------------------------------------------------ */

static struct ggn_train_plan small(const char *name, enum ggn_preset preset)
{
    struct ggn_train_plan p = ggn_train_plan_default(preset);

    p.data = (struct ggn_series_set_options){.dir = data, .split.validation = "scene1"};
    p.out = path_of(name, "");
    p.hyper.window = 3;
    p.hyper.k_r = p.hyper.k_m = 3;
    p.hyper.k_d = 4;
    p.crop = 17;
    p.batch_r = 3;
    p.batch = 4;
    p.steps_r = 5;
    p.steps = 9;
    p.epoch_steps = 3;
    p.seed = 5;
    p.threads = 1;
    return p;
}

static struct ggn_train_plan full(const char *name)
{
    struct ggn_train_plan p = small(name, GGN_PRESET_LULL);

    p.validation_windows = 7;
    p.early_rate = 0.5;
    return p;
}

static void run(const char *name, struct ggn_train_plan plan)
{
    struct base_err err = {0};
    char *said = NULL;
    size_t size;

    plan.progress = open_memstream(&said, &size);
    plan.out = path_of(name, "");
    fprintf(report, "> %s\n", name);
    int rc = ggn_train(&plan, &err);
    assert_int_equal(fclose(plan.progress), 0);
    put(said);
    free(said);
    if (rc) {
        fprintf(report, "%d: ", rc);
        put(err.text);
        fputc('\n', report);
        return;
    }
    put_file(path_of(name, ".csv"));
    put_card(path_of(name, ".card.json"));
    put_checkpoint(path_of(name, ".ckpt"));
    put_model(path_of(name, ""));
}

static void approve_reports(void **state)
{
    (void)state;
    fflush(report);
    for (char *nan; (nan = strstr(reported, "-nan")) != NULL;) /* whose sign depends on the compiler */
        memmove(nan, nan + 1, strlen(nan));
    approve_text("tests/golden/ggn_train_runs.txt", reported);
}

static void presets(void **state)
{
    struct ggn_train_plan all = full("all"), plain = small("plain", GGN_PRESET_LULL),
                          paper = small("paper", GGN_PRESET_PAPER);
    struct ggn_train_plan again = full("again");
    (void)state;
    run("all", all);
    plain.flips = plain.soft_labels = plain.extend = plain.synthetic = 0;
    plain.difference = plain.jitter = 0;
    plain.data.ratio = 1.7; /* every other level */
    plain.steps_r = 7;
    plain.steps = 40;
    plain.epoch_steps = 4;
    plain.patience = 2;
    plain.lr = 0.03;
    plain.threads = 2;
    run("plain", plain);
    paper.steps = paper.epoch_steps = 0;
    paper.epochs = 2;
    paper.batch = 5;
    run("paper", paper);
    again.init = path_of("all", "");
    again.steps_r = 0;
    again.steps = 4;
    run("again", again);
    again.init = NULL;
    again.data.split.validation = "";
    run("blind", again);
}

/* Learning rates that no network survives: halved until it does, or given up; of the second phase only, too. */
static void divergences(void **state)
{
    struct ggn_train_plan lost = small("lost", GGN_PRESET_LULL), saved = lost, late = lost;
    (void)state;
    lost.lr_r = 1e37;
    run("lost", lost);
    saved.lr_r = 3.9e9;
    saved.steps_r = 4;
    saved.steps = 3;
    run("saved", saved);
    late.steps_r = 1;
    late.lr = 1e37;
    run("late", late);
}

/* --- interruptions --------------------------------------------------------------------------------------------------------------------- */

static volatile sig_atomic_t interrupted;
static int rows_left;

/* Progress that interrupts after so many rows of the curves. */
static ssize_t count_rows(void *cookie, const char *text, size_t size)
{
    (void)cookie;
    if (memmem(text, size, "ETA", 3) && --rows_left == 0)
        interrupted = 1;
    return (ssize_t)size;
}

static void same_file(const char *one, const char *other, const char *suffix)
{
    char *data_of[2];
    size_t size[2];

    assert_int_equal(base_file_read(path_of(one, suffix), 1 << 24, &data_of[0], &size[0], NULL), 0);
    assert_int_equal(base_file_read(path_of(other, suffix), 1 << 24, &data_of[1], &size[1], NULL), 0);
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(data_of[0], data_of[1], size[0]);
    free(data_of[0]);
    free(data_of[1]);
}

static void same_files(const char *one, const char *other)
{
    static const char *const suffixes[] = {"", ".csv", ".card.json", ".ckpt"};

    for (size_t i = 0; i < sizeof suffixes / sizeof suffixes[0]; i++)
        same_file(one, other, suffixes[i]);
}

static void interrupted_and_resumed(const char *name, struct ggn_train_plan plan, int rows)
{
    struct base_err err = {0};

    for (int k = 1; k < rows; k++) {
        plan.out = path_of("stopped", "");
        plan.resume = 0;
        plan.interrupted = &interrupted;
        interrupted = 0;
        rows_left = k;
        plan.progress = fopencookie(NULL, "w", (cookie_io_functions_t){.write = count_rows});
        assert_int_equal(ggn_train(&plan, &err), GGN_TRAIN_INTERRUPTED);
        fclose(plan.progress);
        plan.progress = NULL;
        assert_int_equal(access(plan.out, F_OK), -1);
        plan.resume = 1;
        plan.threads = 2;
        plan.interrupted = NULL;
        if (ggn_train(&plan, &err))
            fail_msg("%s", err.text);
        same_files(name, "stopped");
        assert_int_equal(unlink(plan.out), 0);
    }
}

static void whole(const char *name, struct ggn_train_plan plan)
{
    struct base_err err = {0};

    plan.out = path_of(name, "");
    if (ggn_train(&plan, &err))
        fail_msg("%s", err.text);
}

/* Hours end a run with a model at a validation of the last phase; without them it goes on to the same files. */
static void hours(void **state)
{
    struct ggn_train_plan plan = full("stopped");
    char *csv;
    size_t size;
    (void)state;
    unlink(path_of("stopped", ".ckpt"));
    plan.resume = 1;
    plan.hours = 1e-6;
    whole("stopped", plan);
    assert_int_equal(base_file_read(path_of("stopped", ".csv"), 1 << 24, &csv, &size, NULL), 0);
    const char *judge = strstr(csv, "\njudge,");
    assert_true(judge && !strstr(judge + 1, "\njudge,"));
    free(csv);
    plan.hours = 0;
    whole("stopped", plan);
    same_files("all", "stopped");
}

static int threads_now(void)
{
    DIR *tasks = opendir("/proc/self/task");
    int n = 0;

    while (tasks && readdir(tasks))
        n++;
    closedir(tasks);
    return n;
}

/* The second of two such runs leaves nothing on the heap, but for a few kilobytes that glibc keeps in hand. */
static void nothing_stays(void **state)
{
    struct ggn_train_plan plan = full("all");
    const int threads = threads_now(); /* of OpenBLAS too */
    size_t used = 0;
    (void)state;
    plan.init = path_of("all", "");
    plan.steps = plan.steps_r = 2;
    plan.resume = 1;
    plan.threads = 2;
    for (int k = 0; k < 3; k++) {
        struct base_err err = {0};
        unlink(path_of("gone", ".ckpt"));
        plan.out = path_of("gone", "");
        assert_int_equal(ggn_train(&plan, &err), 0);
        assert_int_equal(ggn_train(&plan, &err), 0);
        used = k == 1 ? ggn_heap_used() : used;
    }
    assert_in_range(ggn_heap_used() - used + 32768, 0, 65536);
    assert_int_equal(threads_now(), threads);
}

static void resuming(void **state)
{
    struct ggn_train_plan paper = small("paper", GGN_PRESET_PAPER);
    (void)state;
    interrupted_and_resumed("all", full("all"), 5);
    paper.steps = paper.epoch_steps = 0;
    paper.epochs = 2;
    paper.batch = 5;
    interrupted_and_resumed("paper", paper, 2);
}

/* --- what is refused ------------------------------------------------------------------------------------------------------------------- */

static void try(const char *name, struct ggn_train_plan plan)
{
    struct base_err err = {0};

    plan.out = path_of("bad", "");
    plan.steps = plan.steps_r = plan.epoch_steps = 1;
    int rc = ggn_train(&plan, &err);
    fprintf(report, "%s: %d ", name, rc);
    put(rc ? err.text : "");
    fputc('\n', report);
    assert_int_equal(access(plan.out, F_OK), rc ? -1 : 0);
    unlink(plan.out);
    unlink(path_of("bad", ".ckpt"));
}

#define TRY(plan, change) \
    do { \
        struct ggn_train_plan p = plan; \
        p.change; \
        try(#change, p); \
    } while (0)

static void plans(void **state)
{
    char quiet[64], loud[64];
    struct ggn_train_plan good = small("bad", GGN_PRESET_LULL), paper = small("bad", GGN_PRESET_PAPER), of_all = full("bad");
    (void)state;
    snprintf(quiet, sizeof quiet, "%s/quiet", dir);
    snprintf(loud, sizeof loud, "%s/loud", dir);
    make_views(quiet, 512, 0.01);
    make_views(loud, 512, 1e5);
    fputs("> plans\n", report);
    TRY(good, batch = 0);
    TRY(good, batch = 1);
    TRY(good, batch = 1025);
    TRY(good, batch_r = 0);
    TRY(good, batch_r = 1);
    TRY(good, batch_r = 1025);
    TRY(good, crop = 15);
    TRY(good, crop = 16);
    TRY(good, crop = HEIGHT);
    TRY(good, crop = HEIGHT + 1);
    TRY(good, hyper.k_r = 2);
    TRY(good, hyper.window = 8);
    TRY(good, hyper.window = 9);
    TRY(good, hyper.k_d = 65);
    TRY(good, data.dir = bare);
    TRY(good, data.dir = quiet);
    TRY(good, data.dir = loud);
    TRY(good, data.dir = "/nonexistent");
    TRY(good, data.split.validation = "scene9");
    TRY(good, data.split.validation = "scene0,scene1,scene2");
    TRY(paper, noise_map = 0.5);
    TRY(good, noise_map = 0.5);
    TRY(paper, crop = 1);
    of_all.init = path_of("all", "");
    TRY(of_all, hyper.k_r = 4);
    TRY(of_all, hyper.k_m = 4);
    TRY(of_all, hyper.k_d = 3);
    TRY(of_all, hyper.window = 4);
    TRY(of_all, init = path_of("paper", ""));
    TRY(of_all, init = "/nonexistent");
}

/* The checkpoint of the run "all" with another description, or without its last tensor. */
static void forge(const char *from, const char *to)
{
    struct ggn_container c, forged = {0};
    struct ggn_train_plan plan = full("bad");
    struct base_err err = {0};
    char *hit;

    assert_int_equal(ggn_container_read(&c, path_of("all", ".ckpt"), &err), 0);
    const int n = c.n_entries - (from == NULL);
    forged.json = malloc(strlen(c.json) + 64);
    strcpy(forged.json, c.json);
    if (from) {
        assert_non_null(hit = strstr(c.json, from));
        sprintf(forged.json, "%.*s%s%s", (int)(hit - c.json), c.json, to, hit + strlen(from));
    }
    float *values[64];
    for (int i = 0; i < n; i++) {
        int dim = (int)c.entry[i].count;
        values[i] = malloc(c.entry[i].count * sizeof *values[i]);
        assert_int_equal(ggn_container_get(&c, c.entry[i].name, 1, &dim, values[i], &err), 0);
        assert_int_equal(ggn_container_add(&forged, c.entry[i].name, GGN_F32, 1, &dim, values[i], &err), 0);
    }
    assert_int_equal(ggn_container_write(&forged, path_of("bad", ".ckpt"), &err), 0);
    ggn_container_release(&c);
    ggn_container_release(&forged);
    for (int i = 0; i < n; i++)
        free(values[i]);
    plan.out = path_of("bad", "");
    plan.resume = 1;
    int rc = ggn_train(&plan, &err);
    fprintf(report, "%s becomes %s: %d ", from ? from : "the last tensor", to, rc);
    put(rc ? err.text : "");
    fputc('\n', report);
    assert_int_equal(access(plan.out, F_OK), rc ? -1 : 0);
}

static void checkpoints(void **state)
{
    (void)state;
    fputs("> checkpoints\n", report);
    forge("\"kind\":\"training\"", "\"kind\":\"model\"");
    forge("\"kind\":\"training\"", "\"kind\":1");
    forge("\"phase\":1", "\"phase\":2");
    forge("\"phase\":1", "\"phase\":-1");
    forge("\"step\":9", "\"step\":-1");
    forge("\"steps\":9", "\"steps\":null");
    forge("\"t0\":0", "\"t0\":-1");
    forge("\"t1\":9", "\"t1\":\"9\"");
    forge("\"t2\":9", "\"t3\":9");
    forge("\"identity\":\"", "\"identity\":\"lr=1\\n");
    forge("\"identity\":", "\"key\":");
    forge(NULL, "nothing");
    forge("\"kind\":\"training\"", "\"kind\":\"training\",\"more\":1");
}

/* --- what identifies the data of a run --------------------------------------------------------------------------------------------------- */

#define OTHER(field, value) \
    do { \
        const __typeof__(field) kept = field; \
        field = value; \
        keys[n++] = ggn_series_set_crc(&set); \
        field = kept; \
    } while (0)

static void keys_of_data(void **state)
{
    const struct ggn_train_plan plan = full("all");
    struct ggn_series_set set = {0};
    uint32_t keys[16];
    int n = 0;
    (void)state;
    assert_int_equal(ggn_series_set_load(&set, &plan.data, NULL), 0);
    keys[n++] = ggn_series_set_crc(&set);
    struct ggn_level_series *c = &set.series[set.n - 1];
    OTHER(set.n, set.n - 1);
    OTHER(c->split, GGN_SPLIT_VALIDATION);
    OTHER(c->block, c->block + 7);
    OTHER(c->n_levels, c->n_levels - 1);
    OTHER(c->has_label, 0);
    OTHER(c->label.threshold, c->label.threshold + 1);
    OTHER(c->noisy[0], (uint8_t)(c->noisy[0] + 1));
    OTHER(c->noisy[3 * WIDTH * HEIGHT - 1], (uint8_t)(c->noisy[3 * WIDTH * HEIGHT - 1] + 1));
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++)
            if (keys[i] == keys[k])
                fail_msg("data %d and %d have the same key", i, k);
    ggn_series_set_release(&set);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(presets),      cmocka_unit_test(divergences),   cmocka_unit_test(resuming),
        cmocka_unit_test(hours),        cmocka_unit_test(plans),         cmocka_unit_test(checkpoints),
        cmocka_unit_test(keys_of_data), cmocka_unit_test(nothing_stays), cmocka_unit_test(approve_reports)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
